#include "tests/bench/darm_bench/time_to_quality.hpp"

#include <thread>

#include "client/core/egl_context.hpp"
#include "daemon/config/load.hpp"
#include "daemon/daemon.hpp"
#include "daemon/scene_setup.hpp"
#include "daemon/world.hpp"
#include "tests/bench/darm_bench/frame_tracing.hpp"
#include "tests/bench/darm_bench/recording.hpp"

namespace darm::bench {

namespace {

namespace fs = std::filesystem;
constexpr double kReferencePsnr = 40;  // target + 8 dB and some
constexpr double kSettledSeconds =
    8;  // until every tile of a view is in the stream again, and coded as finely as it will be

client::View to_view(const Camera& camera, const TimeToQualityOptions& options) {
  client::View view;
  view.position = camera.position;
  view.orientation = camera.orientation;
  view.fovy = static_cast<double>(camera.fovy);
  view.width = options.width;
  view.height = options.height;
  return view;
}

Result<client::Reference> read_reference(const std::string& base) {
  auto a = client::read_pfm(base + ".a.pfm");
  auto b = client::read_pfm(base + ".b.pfm");
  if (!a || !b) return fail(base + ": its halves cannot be read: " + (a ? b : a).error().message);
  return client::Reference{std::move(*a), std::move(*b)};
}

Result<client::Reference> reference_of(const renderer::LightTransport& transport, renderer::ReferenceJob job,
                                       const fs::path& file) {
  job.state_file = file;
  job.spp = 4096;
  job.until_psnr = kReferencePsnr;
  const auto made = renderer::render_reference(transport, job);
  if (!made) return std::unexpected(made.error());
  return client::Reference{to_image(made->half_a), to_image(made->half_b)};
}

void remove_stores(const fs::path& dir) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(dir, ignored))
    if (entry.path().extension() == ".store") fs::remove(entry.path(), ignored);
}

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

Result<config::Config> load_config(const TimeToQualityOptions& options) {
  std::vector<fs::path> files;
  if (!options.config.empty()) files.push_back(options.config);
  auto loaded = config::load(files);
  if (!loaded) return fail(config::to_string(loaded.error()));
  if (!options.scene.empty()) loaded->scene.file = options.scene;
  if (options.q > 0) loaded->scene.q = options.q;
  loaded->state.dir = options.state_dir;
  loaded->listen.address = "127.0.0.1";
  loaded->listen.tcp_port = 0;
  loaded->listen.udp_port = 0;
  loaded->listen.metrics_port = -1;
  loaded->listen.http_port = -1;
  loaded->stream.allow_lossless = options.truth_seconds > 0;
  return *loaded;
}

}  // namespace

Result<nlohmann::json> time_to_quality(const TimeToQualityOptions& options) {
  const auto config = load_config(options);
  if (!config) return std::unexpected(config.error());
  const unsigned threads = thread_count(*config);
  std::error_code ignored;
  fs::create_directories(options.state_dir, ignored);
  remove_stores(options.state_dir);
  auto world = build_world(*config, threads);
  if (!world) return std::unexpected(world.error());
  remove_stores(options.state_dir);

  std::vector<client::View> views;
  std::vector<renderer::ReferenceJob> jobs;
  std::vector<client::Reference> references;
  for (const auto& spec : options.cameras) {
    const auto camera = find_camera(*config, *world->scene, spec);
    if (!camera) return std::unexpected(camera.error());
    views.push_back(to_view(*camera, options));
    renderer::ReferenceJob job;
    job.camera = *camera;
    job.viewport = {options.width, options.height};
    job.exposure = world->exposure;
    job.effects = renderer::PictureEffects::kViewIndependent;
    job.threads = threads;
    char name[96];
    std::snprintf(name, sizeof name, "bench-%016llx-%016zx-%ux%u.bin",
                  static_cast<unsigned long long>(world->scene->hash), std::hash<std::string>{}(spec), options.width,
                  options.height);
    auto reference = views.size() <= options.references.size()
                         ? read_reference(options.references[views.size() - 1])
                         : reference_of(*world->transport, job, options.state_dir / name);
    if (!reference) return std::unexpected(reference.error());
    references.push_back(std::move(*reference));
    job.seed_a = 101;
    job.seed_b = 102;
    jobs.push_back(job);
  }

  const auto recordings = record_all(*config, views, options);
  if (!recordings) return std::unexpected(recordings.error());
  const auto context = client::EglContext::create();
  if (!context) return fail(context.error().message);
  auto cameras = nlohmann::json::array();
  std::optional<double> atlas = 0.0, frames = 0.0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto drawn = draw_recordings((*recordings)[i], references[i], options.target_db);
    if (!drawn) return fail(drawn.error().message);
    Result<std::vector<FramePoint>> points{};
    if (options.frames) points = trace_frames(*world->transport, jobs[i], references[i], options.target_db, 256);
    if (!points) return std::unexpected(points.error());
    const auto one_atlas = time_to(drawn->run.series, options.target_db);
    const auto one_frames = time_to(*points, options.target_db);
    atlas = atlas && one_atlas ? std::optional(std::max(*atlas, *one_atlas)) : std::nullopt;
    frames = frames && one_frames ? std::optional(*frames + *one_frames) : std::nullopt;
    cameras.push_back({{"camera", options.cameras[i]},
                       {"seconds_atlas", or_null(one_atlas)},
                       {"seconds_frames", or_null(one_frames)},
                       {"codec_rms", or_null(drawn->codec_rms)},
                       {"ceiling_psnr", or_null(drawn->ceiling_psnr)},
                       {"ceiling_mssim", or_null(drawn->ceiling_mssim)},
                       {"series", to_json(drawn->run.series)},
                       {"frames", to_json(*points)}});
  }
  return nlohmann::json{{"target_db", options.target_db},
                        {"q", world->layout->q},
                        {"threads", threads},
                        {"seconds_atlas", or_null(atlas)},
                        {"seconds_frames", or_null(frames)},
                        {"ratio", or_null(atlas && frames ? std::optional(*frames / *atlas) : std::nullopt)},
                        {"series", cameras}};
}

}  // namespace darm::bench
