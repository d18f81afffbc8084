#include "client/probe/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace darm::client::probe {
namespace {

using Json = nlohmann::ordered_json;

double percentile(std::vector<double> v, double p) {
  std::sort(v.begin(), v.end());
  return v[static_cast<std::size_t>(std::lround(p * static_cast<double>(v.size() - 1)))];
}

double share(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

template <class T>
Json optional(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json to_json(const Milestone& m) {
  const auto& b = m.bytes;
  const std::uint64_t named = b.manifest + b.geometry + b.coarse + b.video + b.page_table;
  return {{"seconds", m.seconds},
          {"bytes",
           {{"total", b.total},
            {"manifest", b.manifest},
            {"geometry", b.geometry},
            {"coarse", b.coarse},
            {"video", b.video},
            {"page_table", b.page_table},
            {"protocol", b.total - std::min(named, b.total)}}},
          {"chunks", m.chunks}};
}

double mean(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x;
  return v.empty() ? 0.0 : sum / static_cast<double>(v.size());
}

// Means add up to the whole; percentiles do not.
Json lag_of(const std::vector<LagSample>& samples) {
  if (samples.empty()) return nullptr;
  std::vector<double> whole;
  std::array<std::vector<double>, kLagStageCount> stages;
  for (const auto& sample : samples) {
    whole.push_back(static_cast<double>(sample.whole) / 1000.0);
    for (std::size_t k = 0; k < kLagStageCount; ++k)
      stages[k].push_back(static_cast<double>(sample.stages[k]) / 1000.0);
  }
  Json j{{"samples", samples.size()},
         {"p50", percentile(whole, 0.5)},
         {"p99", percentile(whole, 0.99)},
         {"mean", mean(whole)}};
  double sum = 0;
  for (std::size_t k = 0; k < kLagStageCount; ++k) {
    sum += mean(stages[k]);
    j["stages"][kLagStages[k]] = {
        {"p50", percentile(stages[k], 0.5)}, {"p99", percentile(stages[k], 0.99)}, {"mean", mean(stages[k])}};
  }
  j["sum_over_whole"] = mean(whole) > 0 ? sum / mean(whole) : 0.0;
  return j;
}

double frames_per_second(const SessionReport& s) {
  double sum = 0;
  for (const double d : s.draw_seconds) sum += d;
  return sum > 0 ? static_cast<double>(s.draw_seconds.size()) / sum : 0.0;
}

double mbit_per_second(const SessionReport& s) {
  return s.stream_seconds > 0 ? static_cast<double>(s.stream_bytes_after_first_image) * 8e-6 / s.stream_seconds : 0.0;
}

}  // namespace

std::string to_json(const Outcome& o) {
  const SessionReport& s = o.session;
  Json j;
  j["psnr"] = o.score ? Json(o.score->psnr) : Json(nullptr);
  j["mssim"] = o.score ? Json(o.score->mssim) : Json(nullptr);
  j["ceiling_psnr"] = o.ceiling ? Json(o.ceiling->psnr) : Json(nullptr);
  j["ceiling_mssim"] = o.ceiling ? Json(o.ceiling->mssim) : Json(nullptr);
  j["reference_psnr"] = optional(o.reference_psnr);
  j["codec_psnr"] = o.codec ? Json(o.codec->psnr) : Json(nullptr);
  j["codec_tiles"] = o.codec ? Json(o.codec->tiles) : Json(nullptr);
  j["rmse"] = o.score ? Json(o.score->rmse) : Json(nullptr);
  j["error"] = optional(s.error);
  j["resolution_error"] = s.resolution_error;
  j["omitted_error"] = s.omitted_error;
  j["seconds_to_first_image"] = s.first_image.seconds;
  j["bytes_to_first_image"] = s.first_image.bytes.total;
  j["first_picture"] = to_json(s.first_picture);
  if (s.first_background) j["first_picture"]["background_fraction"] = *s.first_background;
  j["first_image"] = to_json(s.first_image);
  j["chunks"] = s.chunks;
  j["sharp_fraction"] = share(s.residency.sharp, s.residency.samples);
  j["coarser_fraction"] = share(s.residency.coarser, s.residency.samples);
  j["coarse_fraction"] = share(s.residency.coarse_tex, s.residency.samples);
  j["background_fraction"] = share(s.residency.background, s.residency.samples);
  j["frames"] = s.frames;
  j["key_frames"] = s.key_frames;
  j["frames_lost"] = s.frames_lost;
  j["no_changes"] = s.no_changes;
  j["cameras"] = s.cameras;
  j["answers"] = s.answers;
  j["seconds"] = s.seconds;
  j["bytes"] = s.bytes;
  j["stream_bytes"] = s.stream_bytes;
  j["sent_bytes"] = s.sent_bytes;
  j["mbit_per_second"] = mbit_per_second(s);
  j["fps"] = frames_per_second(s);
  j["triangles"] = s.triangles;
  j["device"] = s.device;
  j["server"] = s.server;
  j["phystex_size"] = s.phystex_size;
  j["view_phystex_size"] = s.view_phystex_size;
  j["target_error"] = s.target_error;
  j["view_slots_used"] = s.view_slots_used;
  j["view_frames"] = s.view_frames;
  j["view_frames_lost"] = s.view_frames_lost;
  j["view_bytes"] = s.view_bytes;
  j["udp"] = s.udp;
  Json latency = Json::object();
  for (const auto& [stage, values] : s.latency_ms)
    latency[stage] = {{"p50", percentile(values, 0.5)}, {"p99", percentile(values, 0.99)}};
  j["latency_ms"] = latency;
  j["lag_ms"] = lag_of(s.lag);
  j["series"] = Json::array();
  for (const auto& p : s.series)
    j["series"].push_back({{"t", p.t},
                           {"psnr", optional(p.psnr)},
                           {"error", optional(p.error)},
                           {"resolution_error", p.resolution_error},
                           {"omitted_error", p.omitted_error}});
  return j.dump(2, ' ', false, Json::error_handler_t::replace);
}

std::string to_text(const Outcome& o) {
  const SessionReport& s = o.session;
  std::string text;
  if (o.score) text += fmt::format("PSNR {:.2f} dB, MSSIM {:.4f}", o.score->psnr, o.score->mssim);
  if (o.ceiling) text += fmt::format(", ceiling {:.2f} dB, {:.4f}", o.ceiling->psnr, o.ceiling->mssim);
  if (o.reference_psnr) text += fmt::format(", reference itself {:.2f} dB", *o.reference_psnr);
  if (!text.empty()) text += "\n";
  text += fmt::format(
      "first picture after {:.2f} s and {:.2f} MB, with the stream {:.2f} s and {:.2f} MB; {} frames, {} without "
      "change, {:.2f} Mbit/s, estimated error {}, beside it for want of finer texels {:.4f}, "
      "for want of light that depends on the eye {:.4f}\n",
      s.first_picture.seconds, static_cast<double>(s.first_picture.bytes.total) / 1e6, s.first_image.seconds,
      static_cast<double>(s.first_image.bytes.total) / 1e6, s.frames, s.no_changes, mbit_per_second(s),
      s.error ? fmt::format("{:.4f}", *s.error) : "not told", s.resolution_error, s.omitted_error);
  text += fmt::format("sharp {:.1f} %, coarser {:.1f} %, CoarseTex {:.1f} %, background {:.1f} %\n",
                      100 * share(s.residency.sharp, s.residency.samples),
                      100 * share(s.residency.coarser, s.residency.samples),
                      100 * share(s.residency.coarse_tex, s.residency.samples),
                      100 * share(s.residency.background, s.residency.samples));
  if (s.view_phystex_size > 0)
    text +=
        fmt::format("private layer: {} slots of {}x{}, {} frames, {:.2f} MB\n", s.view_slots_used, s.view_phystex_size,
                    s.view_phystex_size, s.view_frames, static_cast<double>(s.view_bytes) / 1e6);
  for (const auto& [stage, values] : s.latency_ms) {
    text +=
        fmt::format("{:>12}: p50 {:.1f} ms, p99 {:.1f} ms\n", stage, percentile(values, 0.5), percentile(values, 0.99));
  }
  const Json lag = lag_of(s.lag);
  if (!lag.is_null()) {
    text += fmt::format("shading lag: p50 {:.1f} ms, p99 {:.1f} ms, mean {:.1f} ms =", lag["p50"].get<double>(),
                        lag["p99"].get<double>(), lag["mean"].get<double>());
    for (const auto& [name, stage] : lag["stages"].items())
      text += fmt::format(" {} {:.1f}", name, stage["mean"].get<double>());
    text += "\n";
  }
  text += fmt::format("{:.2f} frames/s on {}{}\n", frames_per_second(s), s.device,
                      o.benched ? "" : " (few draws; --bench-draw measures)");
  return text;
}

}  // namespace darm::client::probe
