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

Result<std::vector<Recording>> record_all(const config::Config& config, const std::vector<client::View>& views,
                                          double seconds) {
  Daemon daemon(config, 1);
  const auto addresses = daemon.start([](const std::string&) {});
  if (!addresses) return std::unexpected(addresses.error());
  std::vector<client::Result<Recording>> made(views.size(), std::unexpected(client::Error("not recorded")));
  std::vector<std::jthread> clients;
  for (std::size_t i = 0; i < views.size(); ++i)
    clients.emplace_back([&, i] { made[i] = record(addresses->tcp, views[i], seconds); });
  clients.clear();  // joins
  (void)daemon.stop(std::chrono::seconds(5));
  std::vector<Recording> out;
  for (auto& m : made) {
    if (!m) return fail(m.error().message);
    out.push_back(std::move(*m));
  }
  return out;
}

nlohmann::json to_json(const std::vector<SeriesPoint>& series) {
  auto out = nlohmann::json::array();
  for (const auto& p : series)
    out.push_back({{"t", p.t}, {"psnr", p.psnr}, {"estimate", p.estimate}, {"to_last", p.to_last}});
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

  const auto recordings = record_all(*config, views, options.seconds);
  if (!recordings) return std::unexpected(recordings.error());
  const auto context = client::EglContext::create();
  if (!context) return fail(context.error().message);
  auto cameras = nlohmann::json::array();
  std::optional<double> atlas = 0.0, frames = 0.0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto series = replay((*recordings)[i], references[i], options.target_db);
    if (!series) return fail(series.error().message);
    const auto points = trace_frames(*world->transport, jobs[i], references[i], options.target_db, 256);
    if (!points) return std::unexpected(points.error());
    const auto one_atlas = time_to(*series, options.target_db);
    const auto one_frames = time_to(*points, options.target_db);
    atlas = atlas && one_atlas ? std::optional(std::max(*atlas, *one_atlas)) : std::nullopt;
    frames = frames && one_frames ? std::optional(*frames + *one_frames) : std::nullopt;
    cameras.push_back({{"camera", options.cameras[i]},
                       {"seconds_atlas", or_null(one_atlas)},
                       {"seconds_frames", or_null(one_frames)},
                       {"series", to_json(*series)},
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
