#include "client/desktop/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace darm::client::desktop {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostValues = 100'000;

std::string bytes_text(double count) {
  if (count < 1e6) return fmt::format("{:.0f} kB", count / 1e3);
  return count < 1e9 ? fmt::format("{:.1f} MB", count / 1e6) : fmt::format("{:.2f} GB", count / 1e9);
}

std::string rate_text(double bits) {
  return bits < 1e6 ? fmt::format("{:.0f} kbit/s", bits / 1e3) : fmt::format("{:.1f} Mbit/s", bits / 1e6);
}

std::string error_text(double error) {
  const std::string levels = fmt::format("{:.2f} of 255", error * 255);
  return error > 0 ? fmt::format("{} ({:.1f} dB)", levels, -20 * std::log10(error)) : levels;  // PSNR
}

std::string lag_text(const Measured& m) { return m.lag_ms ? fmt::format("{:.0f} ms", *m.lag_ms) : "-"; }

std::string frames_text(const Measured& m) {
  return m.frames_per_second ? fmt::format("{:.0f}{}", *m.frames_per_second, m.divisor > 1 ? ", coarser" : "")
                             : "still";
}

Json spread(const Series& series) {
  if (series.empty()) return nullptr;
  return {{"p50", series.percentile(0.5)}, {"p99", series.percentile(0.99)}, {"count", series.count()}};
}

template <class T>
Json optional(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

}  // namespace

void Series::add(double value) {
  last_ = value;
  if (values_.size() < kMostValues) {
    values_.push_back(value);
  } else {
    values_[next_] = value;
    next_ = (next_ + 1) % kMostValues;
  }
}

double Series::percentile(double share) const {
  if (values_.empty()) return 0;
  std::vector<double> sorted = values_;
  const auto at =
      static_cast<std::ptrdiff_t>(std::lround(std::clamp(share, 0.0, 1.0) * static_cast<double>(sorted.size() - 1)));
  std::nth_element(sorted.begin(), sorted.begin() + at, sorted.end());
  return sorted[static_cast<std::size_t>(at)];
}

void Rate::add(double now, double amount) {
  std::erase_if(events_, [&](const auto& e) { return now - e.first > span_ms_; });
  events_.emplace_back(now, amount);
}

double Rate::per_second(double now) const {
  double sum = 0;
  for (const auto& [at, amount] : events_) sum += now - at <= span_ms_ ? amount : 0;
  return sum * 1000 / span_ms_;
}

std::optional<double> fallback_share(const ResidencyCounts& c) {
  const std::uint64_t fallback = c.undefined + c.coarser + c.coarse_tex, surfaces = fallback + c.sharp;
  if (surfaces == 0) return std::nullopt;
  return static_cast<double>(fallback) / static_cast<double>(surfaces);
}

PanelLines panel_lines(const Measured& m) {
  const auto fallback = m.residency ? fallback_share(*m.residency) : std::nullopt;
  std::string cost = bytes_text(static_cast<double>(m.traffic.received));
  if (m.seconds > 5)
    cost += fmt::format(" ({} an hour)", bytes_text(static_cast<double>(m.traffic.received) / m.seconds * 3600));
  cost += fmt::format(", ms: decoding {:.0f}, uploading {:.0f}, drawing {:.0f}", m.decode_ms, m.upload_ms, m.draw_ms);
  return {{"Frames a second", frames_text(m)},
          {"Stream", rate_text(m.bits_per_second)},
          {"Shading lag", lag_text(m)},
          {"Coarser than asked", fallback ? fmt::format("{:.1f} %", *fallback * 100) : "-"},
          {"Error of the light", m.error && *m.error >= 0 ? error_text(*m.error) : "-"},
          {"Error of resolution", error_text(m.resolution_error)},
          {"Reflections left out", error_text(m.omitted_error)},
          {"Cost", cost}};
}

PanelLines brief_lines(const Measured& m) {
  const bool known = m.error && *m.error >= 0;
  return {{"Frames/s", frames_text(m)},
          {"Stream", rate_text(m.bits_per_second)},
          {"Lag", lag_text(m)},
          {"Error", known ? fmt::format("{:.2f} of 255", *m.error * 255) : "-"}};
}

std::string report_json(const VisitFigures& f, const Measured& last) {
  Json j;
  j["frames_per_second"] = f.seconds > 0 ? Json(static_cast<double>(f.frames_drawn) / f.seconds) : Json(nullptr);
  j["decode_ms"] = spread(f.decode_ms);
  j["upload_ms"] = spread(f.upload_ms);
  j["draw_ms"] = spread(f.draw_ms);
  j["lag_ms"] = spread(f.lag_ms);
  j["first_picture_seconds"] = f.first_picture_seconds > 0 ? Json(f.first_picture_seconds) : Json(nullptr);
  j["first_picture_bytes"] = f.first_picture_bytes;
  j["frames_drawn"] = f.frames_drawn;
  j["frames_drawn_alone"] = f.frames_drawn_alone;
  j["stream_frames"] = f.stream_frames;
  j["frames_lost"] = last.traffic.frames_lost;
  j["joins"] = f.joins;
  j["bytes"] = last.traffic.received;
  j["error"] = optional(last.error);
  j["resolution_error"] = last.resolution_error;
  j["omitted_error"] = last.omitted_error;
  j["fallback"] = optional(last.residency ? fallback_share(*last.residency) : std::nullopt);
  j["size"] = {f.width, f.height};
  j["guard_divisor"] = f.coarsest;
  j["device"] = f.device;
  return j.dump(2, ' ', false, decltype(j)::error_handler_t::replace);
}

}  // namespace darm::client::desktop
