#include "tests/bench/darm_bench/setting.hpp"

#include <cstdio>
#include <functional>

#include "daemon/config/load.hpp"
#include "daemon/scene_setup.hpp"
#include "tests/bench/darm_bench/frame_tracing.hpp"

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

Result<Setting> prepare(const TimeToQualityOptions& options) {
  const auto config = load_config(options);
  if (!config) return std::unexpected(config.error());
  const unsigned threads = thread_count(*config);
  std::error_code ignored;
  fs::create_directories(options.state_dir, ignored);
  remove_stores(options.state_dir);
  auto world = build_world(*config, threads);
  if (!world) return std::unexpected(world.error());
  world->store.reset();  // the daemon opens its own
  remove_stores(options.state_dir);

  Setting out;
  out.threads = threads;
  for (const auto& spec : options.cameras) {
    const auto camera = find_camera(*config, *world->scene, spec);
    if (!camera) return std::unexpected(camera.error());
    out.views.push_back(to_view(*camera, options));
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
    auto reference = out.views.size() <= options.references.size()
                         ? read_reference(options.references[out.views.size() - 1])
                         : reference_of(*world->transport, job, options.state_dir / name);
    if (!reference) return std::unexpected(reference.error());
    out.references.push_back(std::move(*reference));
    job.seed_a = 101;
    job.seed_b = 102;
    out.jobs.push_back(job);
  }
  out.config = *config;
  out.world = std::move(*world);
  return out;
}

}  // namespace darm::bench
