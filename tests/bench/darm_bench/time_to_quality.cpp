#include "tests/bench/darm_bench/time_to_quality.hpp"

#include <algorithm>
#include <thread>

#include "client/core/egl_context.hpp"
#include "daemon/daemon.hpp"
#include "tests/bench/darm_bench/frame_tracing.hpp"
#include "tests/bench/darm_bench/recording.hpp"
#include "tests/bench/darm_bench/setting.hpp"

namespace darm::bench {

namespace {

constexpr double kSettledSeconds =
    8;  // until every tile of a view is in the stream again, and coded as finely as it will be

// One client's recordings: of the run, and after it (where a truth is asked for) without codec and with it.
struct ClientRecordings {
  Recording run;
  std::optional<Recording> truth;
  std::optional<Recording> settled;
};

client::Result<ClientRecordings> record_one(std::uint16_t port, const client::View& view, double seconds,
                                            double truth_seconds) {
  ClientRecordings out;
  auto run = record(port, view, seconds);
  if (!run) return std::unexpected(run.error());
  out.run = std::move(*run);
  if (truth_seconds <= 0) return out;
  auto truth = record(port, view, truth_seconds, Stream::kLossless);
  if (!truth) return std::unexpected(truth.error());
  auto settled = record(port, view, kSettledSeconds);
  if (!settled) return std::unexpected(settled.error());
  out.truth = std::move(*truth);
  out.settled = std::move(*settled);
  return out;
}

Result<std::vector<ClientRecordings>> record_all(const config::Config& config, const std::vector<client::View>& views,
                                                 const TimeToQualityOptions& options) {
  Daemon daemon(config, 1);
  const auto addresses = daemon.start([](const std::string&) {});
  if (!addresses) return std::unexpected(addresses.error());
  std::vector<client::Result<ClientRecordings>> made(views.size(), std::unexpected(client::Error("not recorded")));
  std::vector<std::jthread> clients;
  for (std::size_t i = 0; i < views.size(); ++i)
    clients.emplace_back(
        [&, i] { made[i] = record_one(addresses->tcp, views[i], options.seconds, options.truth_seconds); });
  clients.clear();  // joins
  (void)daemon.stop(std::chrono::seconds(5));
  std::vector<ClientRecordings> out;
  for (auto& m : made) {
    if (!m) return fail(m.error().message);
    out.push_back(std::move(*m));
  }
  return out;
}

// What a client's recordings show.
struct Drawn {
  Replayed run;
  std::optional<double> codec_rms;     // of light that no longer changes, with codec and without
  std::optional<double> ceiling_psnr;  // of the truth against the reference
  std::optional<double> ceiling_mssim;
};

client::Result<Drawn> draw_recordings(const ClientRecordings& client, const client::Reference& reference,
                                      double target) {
  Drawn out;
  std::optional<Replayed> truth;
  if (client.truth && client.settled) {
    auto shown = replay(*client.truth, reference, 0);
    if (!shown) return std::unexpected(shown.error());
    auto settled = replay(*client.settled, reference, 0);
    if (!settled) return std::unexpected(settled.error());
    if (shown->series.empty() || settled->series.empty())
      return std::unexpected(client::Error("the truth never was a full picture"));
    out.codec_rms = display_rms(shown->last, settled->last);
    out.ceiling_psnr = shown->series.back().psnr;
    out.ceiling_mssim = shown->series.back().mssim;
    truth = std::move(*shown);
  }
  auto run = replay(client.run, reference, target, truth ? &truth->last : nullptr);
  if (!run) return std::unexpected(run.error());
  out.run = std::move(*run);
  return out;
}

nlohmann::json to_json(const std::vector<SeriesPoint>& series) {
  auto out = nlohmann::json::array();
  for (const auto& p : series)
    out.push_back(
        {{"t", p.t}, {"psnr", p.psnr}, {"mssim", p.mssim}, {"estimate", p.estimate}, {"to_truth", p.to_truth}});
  return out;
}

nlohmann::json to_json(const std::vector<FramePoint>& points) {
  auto out = nlohmann::json::array();
  for (const auto& p : points) out.push_back({{"t", p.seconds}, {"spp", p.spp}, {"psnr", p.psnr}});
  return out;
}

nlohmann::json or_null(const std::optional<double>& value) { return value ? nlohmann::json(*value) : nlohmann::json(); }

// Of everything that came until then: geometry, CoarseTex, frames.
std::optional<double> bytes_until(const Recording& run, std::optional<double> seconds) {
  if (!seconds) return std::nullopt;
  double bytes = 0;
  for (const auto& m : run.messages)
    if (static_cast<double>(m.at_us - run.start_us) * 1e-6 <= *seconds) bytes = static_cast<double>(m.bytes_total);
  return bytes;
}

// Frames and NoChange together, over the whole run.
double updates_per_second(const Recording& run) {
  const auto updates = std::count_if(run.messages.begin(), run.messages.end(), [](const auto& m) {
    return m.envelope.has_frame() || m.envelope.has_no_change();
  });
  const double seconds =
      run.messages.empty() ? 0 : static_cast<double>(run.messages.back().at_us - run.start_us) * 1e-6;
  return seconds > 0 ? static_cast<double>(updates) / seconds : 0;
}

}  // namespace

Result<nlohmann::json> time_to_quality(const TimeToQualityOptions& options) {
  const auto setting = prepare(options);
  if (!setting) return std::unexpected(setting.error());
  const auto recordings = record_all(setting->config, setting->views, options);
  if (!recordings) return std::unexpected(recordings.error());
  const auto context = client::EglContext::create();
  if (!context) return fail(context.error().message);
  auto cameras = nlohmann::json::array();
  std::optional<double> atlas = 0.0, frames = 0.0;
  for (std::size_t i = 0; i < setting->views.size(); ++i) {
    const auto drawn = draw_recordings((*recordings)[i], setting->references[i], options.target_db);
    if (!drawn) return fail(drawn.error().message);
    Result<std::vector<FramePoint>> points{};
    if (options.frames)
      points =
          trace_frames(*setting->world.transport, setting->jobs[i], setting->references[i], options.target_db, 256);
    if (!points) return std::unexpected(points.error());
    const Recording& run = (*recordings)[i].run;
    const auto one_atlas = time_to(drawn->run.series, options.target_db);
    const auto one_frames = time_to(*points, options.target_db);
    atlas = atlas && one_atlas ? std::optional(std::max(*atlas, *one_atlas)) : std::nullopt;
    frames = frames && one_frames ? std::optional(*frames + *one_frames) : std::nullopt;
    cameras.push_back({{"camera", options.cameras[i]},
                       {"seconds_atlas", or_null(one_atlas)},
                       {"seconds_frames", or_null(one_frames)},
                       {"bytes_to_target", or_null(bytes_until(run, one_atlas))},
                       {"updates_per_second", updates_per_second(run)},
                       {"codec_rms", or_null(drawn->codec_rms)},
                       {"ceiling_psnr", or_null(drawn->ceiling_psnr)},
                       {"ceiling_mssim", or_null(drawn->ceiling_mssim)},
                       {"series", to_json(drawn->run.series)},
                       {"frames", to_json(*points)}});
  }
  return nlohmann::json{{"target_db", options.target_db},
                        {"q", setting->world.layout->q},
                        {"threads", setting->threads},
                        {"seconds_atlas", or_null(atlas)},
                        {"seconds_frames", or_null(frames)},
                        {"ratio", or_null(atlas && frames ? std::optional(*frames / *atlas) : std::nullopt)},
                        {"series", cameras}};
}

}  // namespace darm::bench
