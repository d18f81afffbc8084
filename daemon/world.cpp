#include "daemon/world.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <string>
#include <system_error>
#include <thread>

#include "actors/atlas/atlas_report.hpp"
#include "actors/atlas/build_layout.hpp"
#include "actors/renderer/coarse_coverage.hpp"
#include "actors/renderer/exposure.hpp"
#include "actors/renderer/tile_surface_scene.hpp"
#include "daemon/scene_setup.hpp"

namespace darm {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

atlas::LayoutOptions layout_options(const config::Config& config, unsigned threads) {
  atlas::LayoutOptions options;
  options.q = static_cast<float>(config.scene.q);
  options.max_texels = config.atlas.max_texels;
  options.threads = threads;
  options.progress = [last = std::string(), tenth = -1](std::string_view stage, float fraction) mutable {
    const int now = static_cast<int>(fraction * 10);
    if (stage == last && now == tenth) return;
    last = stage;
    tenth = now;
    spdlog::info("atlas: {} {} %", stage, now * 10);
  };
  return options;
}

// What is missing in the picture should be looked for in the file, not in the renderer.
void warn_of_dropped(const scene::Scene& scene, const atlas::Layout& layout) {
  std::uint64_t total = 0;
  std::string words;
  for (const auto& [reason, count] : atlas::dropped_triangles(scene, layout)) {
    if (count == 0) continue;
    total += count;
    words += fmt::format("{}{} {}", words.empty() ? "" : ", ", count, reason);
  }
  if (total > 0) spdlog::warn("{}: {} triangles are left out ({})", scene.path, total, words);
}

Result<void> make_state_dir(const std::filesystem::path& dir) {
  std::error_code error;
  std::filesystem::create_directories(dir, error);
  if (error) return fail(dir.string() + ": the state directory cannot be made: " + error.message());
  return {};
}

/// What the stored light depends on beside scene and layout: the sample sequences, what a sample means, and where paths
/// ended: light that was taken from other light must not stand for traced light.
constexpr std::uint64_t kLightVersion = 4;
std::uint64_t light_key(const config::Config& config) {
  return kLightVersion * 2 + (config.accuracy.indirect == "traced" ? 1 : 0);
}

}  // namespace

unsigned thread_count(const config::Config& config) {
  return config.render.threads != 0 ? config.render.threads : std::max(1u, std::thread::hardware_concurrency());
}

Result<World> load_world(const config::Config& config, unsigned threads) {
  World world;
  if (auto made = make_state_dir(config.state.dir); !made) return std::unexpected(made.error());

  auto start = Clock::now();
  auto scene = load_configured_scene(config);
  if (!scene) return std::unexpected(scene.error());
  world.scene = std::move(*scene);
  for (const auto& warning : world.scene->warnings) spdlog::warn("{}: {}", world.scene->path, warning);
  spdlog::info("scene: {} triangles, {} materials, {} images, {} lights in {:.2f} s", world.scene->triangle_count(),
               world.scene->materials.size(), world.scene->images.size(), world.scene->lights.size(),
               seconds_since(start));

  // The rays do not need the layout, so they are built beside it.
  start = Clock::now();
  auto building = std::async(std::launch::async, [&] { return renderer::trace::RayScene::build(world.scene, 1); });
  atlas::LayoutTimes times;
  auto layout = atlas::cached_layout(*world.scene, layout_options(config, threads), config.state.dir, &times);
  auto rays = building.get();
  if (!layout) return std::unexpected(layout.error());
  if (!rays) return std::unexpected(rays.error());
  world.layout = std::move(*layout);
  world.rays = std::move(*rays);
  warn_of_dropped(*world.scene, *world.layout);
  const auto& finest = world.layout->levels.front();
  spdlog::info("atlas: {} patches, q {}, {} levels, {} x {} texels, occupancy {:.2f} ({} in {:.2f} s)",
               world.layout->patch_count, world.layout->q, world.layout->levels.size(), finest.width, finest.height,
               finest.occupancy, times.pack > 0 ? "packed" : "from the cache", seconds_since(start));

  world.transport = std::make_shared<renderer::LightTransport>(world.scene, world.rays);
  world.exposure = config.scene.exposure > 0 ? static_cast<float>(config.scene.exposure)
                                             : renderer::scene_exposure(*world.transport);
  world.mapper = std::make_shared<atlas::TexelMapper>(world.scene, world.layout);

  world.view_materials = std::make_shared<const std::vector<scene::ViewMaterial>>(scene::view_materials(*world.scene));
  spdlog::info("private layer: {}", world.has_view_layer() ? "for sessions that can take one" : "nothing calls for it");
  return world;
}

Result<std::shared_ptr<atlas::RadianceStore>> open_store(const config::Config& config, const World& world,
                                                         const std::filesystem::path& folder) {
  const atlas::StoreOptions options{.max_bytes = config.state.max_store_bytes, .reserve_last_level = true};
  auto store = atlas::RadianceStore::open(folder, {world.scene->hash, world.layout->hash, light_key(config)},
                                          *world.layout, options);
  if (!store) return std::unexpected(store.error());
  return std::shared_ptr<atlas::RadianceStore>(std::move(*store));
}

Result<World> build_world(const config::Config& config, unsigned threads) {
  auto made = load_world(config, threads);
  if (!made) return made;
  World& world = *made;
  const auto start = Clock::now();
  const int coarse = world.layout->coarse_level();
  const auto surfaces = renderer::make_scene_surfaces(world.scene, world.mapper, world.transport);
  const auto coverage = renderer::coarse_coverage(
      *world.scene, coarse, renderer::level_tiles_of(*world.layout)[static_cast<std::size_t>(coarse)], *surfaces,
      threads);
  auto geometry = session::GeometryStream::build(*world.scene, *world.layout, world.exposure, threads, coverage);
  if (!geometry) return std::unexpected(geometry.error());
  world.geometry = std::move(*geometry);
  spdlog::info("geometry: {} chunks, {:.2f} MB in {:.2f} s, exposure {:.4g}", world.geometry->chunk_count(),
               static_cast<double>(world.geometry->total_bytes()) * 1e-6, seconds_since(start), world.exposure);

  auto store = open_store(config, world, config.state.dir);
  if (!store) return std::unexpected(store.error());
  world.store = std::move(*store);
  const auto path = world.store->path().string();
  const auto stored = world.store->counters();
  if (!world.store->refused_reason().empty())
    spdlog::warn("radiance store: {}: {}; a new one is begun, the old one kept as {}.refused", path,
                 world.store->refused_reason(), path);
  if (stored.bad_entries > 0)
    spdlog::warn("radiance store: {}: {} tiles refused: the file is damaged or cut off", path, stored.bad_entries);
  if (stored.bytes > config.state.max_store_bytes)
    spdlog::warn("radiance store: {}: its {} bytes are over state.max_store_bytes = {}; it is used and does not grow",
                 path, stored.bytes, config.state.max_store_bytes);
  spdlog::info("radiance store: {} tiles in {}", stored.tiles, path);
  return made;
}

}  // namespace darm
