// Seconds and decibels: when a curve is where, and what the next decibel costs. Pure.
#pragma once

#include <optional>
#include <vector>

#include "daemon/accuracy/report/measurement.hpp"

namespace darm::accuracy {

/// First time from which a curve is at `db` and stays there; between two points log time goes with dB, since noise
/// falls as a power of time. A curve that begins above gives its first time. nullopt: never, or no points.
[[nodiscard]] std::optional<double> time_to(const std::vector<Point>& curve, double db);

/// One whole decibel further.
struct DecibelPrice {
  int db = 0;          ///< from here to db + 1
  double reached = 0;  ///< when db + 1 is there, seconds
  double seconds = 0;  ///< from db to db + 1; >= 0
};

/// The prices of all whole decibels between the first and the last picture of a curve, in order. A decibel that the
/// first picture has already has no price.
[[nodiscard]] std::vector<DecibelPrice> decibel_prices(const std::vector<Point>& curve);

/// time_to() of one curve over that of another; nullopt where one does not get there.
[[nodiscard]] std::optional<double> time_ratio(const std::vector<Point>& curve, const std::vector<Point>& other,
                                               double db);

}  // namespace darm::accuracy
