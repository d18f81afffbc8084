#include "actors/atlas/working_set.hpp"

#include <cmath>

namespace darm::atlas {

void WorkingSetCounter::add(PatchId patch, int level, glm::vec2 uv) {
  const Level& l = other_ ? *other_ : layout_.levels[static_cast<std::size_t>(level)];
  const auto& place = l.placements[index_of(patch)];
  const glm::vec2 offset = uv * (place.scale * l.density);
  // Relative to the patch's first texel centre, so that large atlas positions cost no precision.
  const glm::vec2 base(std::floor(offset.x), std::floor(offset.y));
  const glm::vec2 rest = offset - base;
  for (std::uint32_t dy = 0; dy < (rest.y > 0 ? 2u : 1u); ++dy)
    for (std::uint32_t dx = 0; dx < (rest.x > 0 ? 2u : 1u); ++dx) {
      const auto x = place.x + static_cast<std::uint32_t>(base.x) + dx;
      const auto y = place.y + static_cast<std::uint32_t>(base.y) + dy;
      if (x >= l.width || y >= l.height) continue;
      const TileId tile(level, y / kTileSize * l.tiles_x + x / kTileSize);
      tiles_[tile].set(static_cast<int>(x % kTileSize), static_cast<int>(y % kTileSize));
    }
}

std::uint64_t WorkingSetCounter::texels() const {
  std::uint64_t n = 0;
  for (const auto& [tile, mask] : tiles_) n += static_cast<std::uint64_t>(mask.count());
  return n;
}

double WorkingSetCounter::efficiency() const {
  return tiles_.empty()
             ? 0.0
             : static_cast<double>(texels()) / (static_cast<double>(kTileTexels) * static_cast<double>(tiles()));
}

}  // namespace darm::atlas
