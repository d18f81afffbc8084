// What is measured of a visit, as the panel's lines and as a report. Pure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/core/renderer_gles.hpp"

namespace darm::client::desktop {

/// The newest values of a series; old ones go so that a visit may last for days.
class Series {
 public:
  void add(double value);
  [[nodiscard]] bool empty() const { return values_.empty(); }
  [[nodiscard]] double last() const { return last_; }
  [[nodiscard]] std::size_t count() const { return values_.size(); }
  /// `share` in [0, 1]: 0.5 the median. Of an empty series: 0.
  [[nodiscard]] double percentile(double share) const;

 private:
  std::vector<double> values_;
  std::size_t next_ = 0;
  double last_ = 0;
};

/// Events a second over the last second. Times are milliseconds, rising.
class Rate {
 public:
  void add(double now, double amount = 1);
  /// Of `amount` a second, over the last `span_ms` before `now`.
  [[nodiscard]] double per_second(double now) const;
  explicit Rate(double span_ms) : span_ms_(span_ms) {}

 private:
  double span_ms_;
  std::vector<std::pair<double, double>> events_;
};

struct Traffic {
  std::uint64_t received = 0;  ///< bytes of messages, all connections
  std::uint64_t stream = 0;    ///< those of frames, CoarseTex and answers
  std::uint64_t frames_lost = 0;
};

struct Measured {
  std::optional<double> frames_per_second;  ///< drawn while something moves; nothing: still
  double draw_ms = 0, upload_ms = 0, decode_ms = 0;
  std::uint32_t divisor = 1;  ///< of the frame-rate guard: the window's pixels over the picture's, on a side
  double bits_per_second = 0;
  Traffic traffic;
  std::optional<double> lag_ms;  ///< from a camera sent until a picture made for it was drawn
  std::optional<ResidencyCounts> residency;
  std::optional<double> error;  ///< estimated RMS display error of the light, 0..1
  double resolution_error = 0;  ///< beside it: for want of finer texels than the atlas has
  double omitted_error = 0;     ///< beside both: of light that depends on the eye and is not streamed
  double seconds = 0;           ///< since the start
};

/// Name and value of each line of the panel: frames a second, stream, shading lag, share of fallback, error, cost.
using PanelLines = std::vector<std::array<std::string, 2>>;
[[nodiscard]] PanelLines panel_lines(const Measured& m);
/// The most telling of them in few words, for a small window.
[[nodiscard]] PanelLines brief_lines(const Measured& m);

/// Share of the samples on surfaces that are drawn coarser than asked for, or without light; nothing: none seen.
[[nodiscard]] std::optional<double> fallback_share(const ResidencyCounts& counts);

/// A whole visit, for --report.
struct VisitFigures {
  Series decode_ms, upload_ms, draw_ms, lag_ms;
  std::uint64_t frames_drawn = 0;        ///< since the first whole picture
  std::uint64_t frames_drawn_alone = 0;  ///< of these, those without a server
  double seconds = 0;                    ///< since then
  double first_picture_seconds = 0;      ///< from the start until then; 0: none came
  std::uint64_t first_picture_bytes = 0;
  std::uint64_t stream_frames = 0;
  unsigned joins = 0;
  std::uint32_t width = 0, height = 0;
  std::uint32_t coarsest = 1;  ///< largest divisor of the frame-rate guard since the first whole picture
  std::string device;          ///< the GL that drew
};
[[nodiscard]] std::string report_json(const VisitFigures& figures, const Measured& last);

}  // namespace darm::client::desktop
