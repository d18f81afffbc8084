// A still view of a scene and the pictures of its tiles, made in one process by the same functions as `darmd serve`.
#pragma once

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "actors/atlas/parallel.hpp"
#include "actors/renderer/coarse_level.hpp"
#include "actors/renderer/stored_light.hpp"
#include "actors/renderer/texel_shading.hpp"
#include "actors/renderer/tile_display.hpp"
#include "actors/renderer/tile_surface_scene.hpp"
#include "actors/tile_scheduler/image_store.hpp"
#include "actors/tile_scheduler/view_job.hpp"
#include "actors/tile_scheduler/working_set.hpp"
#include "daemon/config/load.hpp"
#include "daemon/scene_setup.hpp"
#include "daemon/world.hpp"

namespace darm::bench {

inline constexpr Viewport kViewport{1280, 720};
inline constexpr unsigned kThreads = 2;

struct LitView {
  config::Config config;
  World world;
  Camera camera;
  tile_scheduler::WorkingSet set;
  std::vector<tile_scheduler::WeightedChain> chains;
  tile_scheduler::ImageStore images{std::size_t{8} << 30};
};

/// Tiles that the view reads at their sharp level, with the texels.
inline std::map<TileId, TexelMask> sharp_texels(const LitView& view) {
  std::map<TileId, TexelMask> out;
  const auto& seen = view.set.current();
  for (std::size_t i = 0; i < seen.tiles().size(); ++i)
    if (!seen.uses()[i].sharp.empty()) out[seen.tiles()[i]] |= seen.uses()[i].sharp;
  return out;
}

using TexelName = std::pair<TileId, int>;

/// At most `count` random texels that the view reads at their sharp level, in order; of the coarse level where
/// `coarse`.
inline std::vector<TexelName> random_texels(const LitView& view, std::size_t count, bool coarse) {
  std::vector<TexelName> seen;
  for (const auto& [tile, mask] : sharp_texels(view))
    for (int t = 0; t < kTileTexels && (coarse || tile.level() < view.world.layout->coarse_level()); ++t)
      if (mask.test(t)) seen.emplace_back(tile, t);
  std::shuffle(seen.begin(), seen.end(), std::mt19937(7));
  seen.resize(std::min(seen.size(), count));
  std::sort(seen.begin(), seen.end());
  return seen;
}

/// Surfaces whose samples are independent, by two seeds: of one sequence they would not be, since what one half has
/// left out the other has.
using Halves = std::array<std::shared_ptr<renderer::TileSurfaces>, 2>;
inline Halves make_halves(const LitView& view, std::uint64_t seed) {
  Halves halves;
  for (std::size_t h = 0; h < halves.size(); ++h)
    halves[h] = renderer::make_scene_surfaces(view.world.scene, view.world.mapper, view.world.transport, seed + 2 * h);
  return halves;
}

using TileMasks = std::unordered_map<TileId, TexelMask>;

/// Loads scene, atlas and store of `view.config` (created in its state directory if they are not there); the working
/// set is traced, nothing is lit. Without a camera, the one a client starts with.
inline Result<void> open_view(LitView& view, const std::string& camera) {
  auto world = build_world(view.config, kThreads);
  if (!world) return std::unexpected(world.error());
  view.world = std::move(*world);
  const auto found = camera.empty() ? Result<Camera>(start_camera(view.config, *view.world.scene))
                                    : find_camera(view.config, *view.world.scene, camera);
  if (!found) return std::unexpected(found.error());
  view.camera = *found;
  for (int pass = 0; pass < tile_scheduler::kAllPasses; ++pass) {
    tile_scheduler::ViewJob job(1, view.world.layout, view.world.rays, view.camera, kViewport, pass, 1, kThreads);
    atlas::parallel_for(kThreads, kThreads, [&](std::size_t s) { job.run_slice(static_cast<unsigned>(s)); });
    for (const auto& part : job.results()) view.set.add(part, 0);
    view.set.add(tile_scheduler::VisibleSet(), 1);
  }
  view.chains = tile_scheduler::chains_of(view.set.seen());
  return {};
}

inline Result<void> open_view(LitView& view, const char* setup, const char* scene, const char* camera,
                              const char* state_dir, double q) {
  spdlog::set_default_logger(spdlog::stderr_logger_mt("bench"));  // standard output is the figures' alone
  auto loaded = config::load(std::vector<std::filesystem::path>{setup});
  if (!loaded) return fail(config::to_string(loaded.error()));
  view.config = std::move(*loaded);
  view.config.scene.file = scene;
  view.config.state.dir = state_dir;
  view.config.scene.q = q;
  return open_view(view, camera);
}

/// What a daemon lights for this view: sharp texels, those of coarser tiles that may stand in, and borders.
inline TileMasks wanted_texels(const LitView& view) {
  TileMasks masks;
  tile_scheduler::for_each_use(view.set.seen(), [&](TileId tile, const tile_scheduler::TileUse& use) {
    auto& mask = masks[tile];
    mask |= use.sharp;
    mask |= use.fallback;
    mask |= use.border;
  });
  return masks;
}

/// Brings every texel to `samples` (0: what the store has) and draws the tiles into `view.images`.
inline void light(LitView& view, const TileMasks& masks, std::uint32_t samples) {
  const std::vector<std::pair<TileId, TexelMask>> tiles(masks.begin(), masks.end());
  const auto surfaces = renderer::make_scene_surfaces(view.world.scene, view.world.mapper, view.world.transport);
  const auto levels = renderer::level_tiles_of(*view.world.layout);
  const auto level_of = [&](std::size_t i) { return levels[static_cast<std::size_t>(tiles[i].first.level())]; };
  auto& store = *view.world.store;
  renderer::TileFactsCache facts(tiles.size() + 16);
  atlas::parallel_for(tiles.size(), kThreads, [&](std::size_t i) {
    const renderer::trace::DenormalsAreZero denormals;
    const auto& [tile, mask] = tiles[i];
    const auto surface = surfaces->tile(tile);
    if (!surface) return;
    for (std::uint32_t n = 0; n < samples; n += 8)
      if (!renderer::shade_tile(store, tile, mask, 8, *surface, samples)) return;
    if (const auto known = facts.get(tile, *surfaces, store); known && known->learn_albedo(*surface, mask, 8))
      if (auto update = store.begin_update(tile)) update->put_albedo(known->albedo_means);
  });
  std::vector<tile_scheduler::ShadedTile> shaded(tiles.size());
  atlas::parallel_for(tiles.size(), kThreads, [&](std::size_t i) {
    renderer::TileDisplay display(store, facts, {view.world.exposure});
    shaded[i].tile = tiles[i].first;
    shaded[i].version = 1;
    if (auto picture = display.draw(tiles[i].first, level_of(i), tiles[i].second)) shaded[i].image = picture->image;
  });
  for (const auto& s : shaded)
    if (s.image) view.images.put(s);
}

/// The coarse level as the renderer brings it on: rounds 1, 2, 4, ... each reading what the one before left. Returns
/// the last one's light; null without rounds.
inline std::shared_ptr<const renderer::StoredLight> light_coarse(LitView& view, renderer::TileSurfaces& surfaces,
                                                                 std::uint32_t rounds) {
  const int level = view.world.layout->coarse_level();
  const auto tiles = renderer::level_tiles_of(*view.world.layout).back();
  auto& store = *view.world.store;
  renderer::TileFactsCache facts(std::size_t{tiles.x} * tiles.y + 16);
  std::shared_ptr<const renderer::StoredLight> last;
  for (std::uint32_t n = 1; n <= rounds; n *= 2) {
    atlas::parallel_for(std::size_t{tiles.x} * tiles.y, kThreads, [&](std::size_t i) {
      const renderer::trace::DenormalsAreZero denormals;
      const TileId tile(level, static_cast<std::uint32_t>(i));
      const auto surface = surfaces.tile(tile);
      (void)renderer::shade_tile(store, tile, TexelMask::all(), n, *surface, n);
      if (const auto known = facts.get(tile, surfaces, store);
          known && known->learn_albedo(*surface, TexelMask::all(), 4))
        if (auto update = store.begin_update(tile)) update->put_albedo(known->albedo_means);
    });
    auto light = std::make_shared<renderer::StoredLight>(view.world.layout);
    atlas::parallel_for(std::size_t{tiles.x} * tiles.y, kThreads, [&](std::size_t i) {
      const TileId tile(level, static_cast<std::uint32_t>(i));
      renderer::TileDisplay display(store, facts, {view.world.exposure});
      (void)display.draw(tile, tiles, TexelMask::all());
      if (const auto stored = store.read(tile))
        light->put(tile.index(), renderer::stored_texels(*stored, display.filtered()));
    });
    surfaces.find_bright(*light);
    surfaces.use_stored_light(light);
    last = light;
  }
  return last;
}

}  // namespace darm::bench
