// Error against time as a picture: SVG without scripts, in the colours of the reader's scheme. Pure.
#pragma once

#include <string>
#include <vector>

#include "daemon/accuracy/report/measurement.hpp"

namespace darm::accuracy {

struct Series {
  std::string label;
  std::vector<Point> points;  ///< those without a positive finite time and a finite dB are left out
};

struct Chart {
  std::string id;           ///< unique in its page: letters, digits, hyphens
  std::string title;        ///< for those who hear the page
  std::string description;  ///< likewise
  std::vector<Series> series;
};

/// At most this many series have looks of their own; later ones repeat them.
inline constexpr std::size_t kLooks = 7;

/// dB over a logarithmic time axis; each curve is named at its right end, and differs in colour and marker. Well-formed
/// for any input: without points it says so. `standalone`: a file of its own with its style; else chart_style() must be
/// in the page.
[[nodiscard]] std::string svg_chart(const Chart& chart, bool standalone);

/// CSS of charts, both colour schemes.
[[nodiscard]] std::string chart_style();

/// Marks of a logarithmic axis from `low` to `high` (0 < low < high, finite): 1, 2 and 5 of each decade, thinned to at
/// most 12.
[[nodiscard]] std::vector<double> log_marks(double low, double high);

}  // namespace darm::accuracy
