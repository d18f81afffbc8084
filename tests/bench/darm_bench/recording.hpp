// What a client receives, kept with its times, and drawn afterwards: drawing on the server's own cores would slow what
// is measured.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/core/connection.hpp"
#include "client/core/image_metrics.hpp"

namespace darm::bench {

struct Recording {
  client::View view;
  wire::Welcome welcome;
  std::int64_t start_us = 0;  ///< when the first camera was sent
  std::vector<client::Received> messages;
};

/// As it comes to everybody, or without codec and with room for every tile (the daemon must allow it).
enum class Stream : std::uint8_t { kCoded, kLossless };

/// Connects to 127.0.0.1:`port`, sends `view` at once and ten times a second, and records for `seconds` from then on.
[[nodiscard]] client::Result<Recording> record(std::uint16_t port, const client::View& view, double seconds,
                                               Stream stream = Stream::kCoded);

struct SeriesPoint {
  double t = 0;
  double psnr = 0;
  double mssim = 0;
  double estimate = 0;  ///< the server's error estimate at that time, display RMS
  double to_truth = 0;  ///< display RMS to the truth given, else to the last picture of the recording
};

struct Replayed {
  std::vector<SeriesPoint> series;
  client::Image8 last;  ///< empty if there never was a full picture
};

/// Applies the recording message by message in the current GL context and draws where a frame or CoarseTex changed the
/// picture: up to `target` dB at every change at least 4 % later than the last drawn, after that at times a quarter
/// apart. Pictures with pixels without light do not count. Times are when the message had come.
[[nodiscard]] client::Result<Replayed> replay(const Recording& recording, const client::Reference& reference,
                                              double target, const client::Image8* truth = nullptr);

/// Root mean square difference of display values, 0..1. Pictures of one size.
[[nodiscard]] double display_rms(const client::Image8& a, const client::Image8& b);

/// First time at which a series is at `target` dB and stays there; nullopt: never.
[[nodiscard]] std::optional<double> time_to(const std::vector<SeriesPoint>& series, double target);

}  // namespace darm::bench
