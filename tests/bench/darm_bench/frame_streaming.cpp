#include "tests/bench/darm_bench/frame_streaming.hpp"

#include <algorithm>

#include "tests/bench/darm_bench/pixel_streaming.hpp"
#include "tests/bench/darm_bench/setting.hpp"

namespace darm::bench {

namespace {

using Json = nlohmann::json;

Json of_pixels(const PixelStreamingRun& run, double target) {
  double seconds = 0, bytes = 0, updates = 0, first = 0;
  bool reached = true;
  for (const auto& client : run.clients) {
    const auto at = point_at(client, target);
    reached = reached && at;
    seconds = std::max(seconds, at ? at->t : 0.0);
    bytes += at ? static_cast<double>(at->bytes) : 0.0;
    updates += static_cast<double>(client.updates);
    first += client.series.empty() ? 0.0 : client.series.front().psnr;
  }
  const auto clients = static_cast<double>(std::max<std::size_t>(run.clients.size(), 1));
  return {{"seconds", reached ? Json(seconds) : Json()},
          {"bytes", reached ? Json(bytes) : Json()},
          {"updates_per_second", run.seconds > 0 ? updates / clients / run.seconds : 0.0},
          {"first_db", first / clients}};
}

Json of_darm(const Json& report) {
  double bytes = 0, updates = 0;
  bool reached = true;
  for (const auto& camera : report["series"]) {
    reached = reached && camera["bytes_to_target"].is_number();
    if (camera["bytes_to_target"].is_number()) bytes += camera["bytes_to_target"].get<double>();
    updates += camera["updates_per_second"].get<double>();
  }
  const auto clients = static_cast<double>(std::max<std::size_t>(report["series"].size(), 1));
  return {{"seconds", report["seconds_atlas"]},
          {"bytes", reached ? Json(bytes) : Json()},
          {"updates_per_second", updates / clients}};
}

Json ratio(const Json& pixels, const Json& darm) {
  Json out = Json::object();
  for (const char* key : {"seconds", "bytes", "updates_per_second"})
    out[key] = pixels[key].is_number() && darm[key].is_number() && darm[key].get<double>() > 0
                   ? Json(pixels[key].get<double>() / darm[key].get<double>())
                   : Json();
  return out;
}

}  // namespace

Result<Json> frame_streaming(const TimeToQualityOptions& all) {
  Json runs = Json::array();
  for (const std::size_t count : {std::size_t{1}, std::size_t{4}, std::size_t{8}}) {
    if (count > all.cameras.size()) break;
    TimeToQualityOptions options = all;
    options.cameras.resize(count);
    options.frames = false;
    const auto darm = time_to_quality(options);
    if (!darm) return std::unexpected(darm.error());
    const auto setting = prepare(options);
    if (!setting) return std::unexpected(setting.error());
    PixelStreamingOptions pixels;
    pixels.target_db = options.target_db;
    const auto streamed =
        stream_pixels(*setting->world.transport, setting->jobs, setting->references, *setting->world.layout, pixels);
    if (!streamed) return std::unexpected(streamed.error());
    Json run = {{"clients", count}, {"darm", of_darm(*darm)}, {"pixels", of_pixels(*streamed, options.target_db)}};
    run["ratio"] = ratio(run["pixels"], run["darm"]);
    runs.push_back(std::move(run));
  }
  return Json{{"target_db", all.target_db}, {"runs", runs}};
}

}  // namespace darm::bench
