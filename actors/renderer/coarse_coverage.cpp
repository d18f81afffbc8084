#include "actors/renderer/coarse_coverage.hpp"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "actors/atlas/parallel.hpp"
#include "actors/renderer/tile_facts.hpp"

namespace darm::renderer {

std::vector<std::uint8_t> coarse_coverage(const scene::Scene& scene, int level, const LevelTiles& tiles,
                                          const TileSurfaces& surfaces, unsigned threads) {
  if (std::all_of(scene.materials.begin(), scene.materials.end(),
                  [](const auto& m) { return m.alpha_mode == scene::AlphaMode::kOpaque; }))
    return {};
  const std::size_t width = std::size_t{tiles.x} * kTileSize;
  std::vector<std::uint8_t> out(width * tiles.y * kTileSize, 255);
  std::atomic<bool> opaque = true;
  atlas::parallel_for(std::size_t{tiles.x} * tiles.y, threads, [&](std::size_t t) {
    const auto tile = cover_tile(TileId(level, static_cast<std::uint32_t>(t)), tiles, surfaces);
    if (!tile) return;
    opaque = false;
    std::uint8_t* corner = &out[t / tiles.x * kTileSize * width + t % tiles.x * kTileSize];
    for (std::size_t y = 0; y < kTileSize; ++y)
      std::memcpy(corner + y * width, &(*tile)[(y + 1) * kSlotSize + 1], kTileSize);
  });
  if (opaque) out.clear();
  return out;
}

}  // namespace darm::renderer
