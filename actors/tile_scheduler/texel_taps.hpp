// The texels that a bilinear look-up at one atlas position reads.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/vec2.hpp>

#include "actors/atlas/layout.hpp"

namespace darm::tile_scheduler {

/// Inclusive box of texels of a level.
struct TexelBox {
  int x0 = 0;
  int y0 = 0;
  int x1 = 0;
  int y1 = 0;
};

/// The texels with weight in a bilinear look-up at continuous position `texel` (Layout::texel_at), within the level.
[[nodiscard]] inline TexelBox taps_at(const atlas::Level& level, glm::vec2 texel) {
  const auto limit = [](float value, std::uint32_t size) {
    return std::isfinite(value) ? std::clamp(value, 0.0f, static_cast<float>(size - 1)) : 0.0f;
  };
  const float x = limit(texel.x - 0.5f, level.width);
  const float y = limit(texel.y - 0.5f, level.height);
  return {static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y)), static_cast<int>(std::ceil(x)),
          static_cast<int>(std::ceil(y))};
}

/// The tile whose slot a client reads for position `texel`: the one that holds it, kept within the level.
[[nodiscard]] inline TileId tile_holding(const atlas::Layout& layout, int level, glm::vec2 texel) {
  const auto& l = layout.levels[static_cast<std::size_t>(level)];
  const auto limit = [](float value, std::uint32_t size) {
    return std::isfinite(value) ? std::clamp(value, 0.0f, static_cast<float>(size) - 0.5f) : 0.0f;
  };
  return layout.tile_at(level, {limit(texel.x, l.width), limit(texel.y, l.height)});
}

/// Calls mark(TileId, part) for each tile that the box touches; `part` is in the tile's own payload texels.
template <class Mark>
void for_each_tile_part(const atlas::Level& level, int level_number, const TexelBox& box, const Mark& mark) {
  for (int ty = box.y0 / kTileSize; ty <= box.y1 / kTileSize; ++ty)
    for (int tx = box.x0 / kTileSize; tx <= box.x1 / kTileSize; ++tx) {
      TexelBox part;
      part.x0 = std::max(box.x0 - tx * kTileSize, 0);
      part.y0 = std::max(box.y0 - ty * kTileSize, 0);
      part.x1 = std::min(box.x1 - tx * kTileSize, kTileSize - 1);
      part.y1 = std::min(box.y1 - ty * kTileSize, kTileSize - 1);
      mark(TileId(level_number, static_cast<std::uint32_t>(ty) * level.tiles_x + static_cast<std::uint32_t>(tx)), part);
    }
}

}  // namespace darm::tile_scheduler
