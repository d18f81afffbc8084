// Walls that stand on a tile's surface, between one texel and the next: light on their other side says nothing of this.
#pragma once

#include <array>
#include <cstdint>

#include "actors/atlas/tile_texels.hpp"
#include "actors/renderer/trace/ray_scene.hpp"
#include "actors/renderer/trace/surface.hpp"
#include "actors/types/tile_id.hpp"

namespace darm::renderer {

/// Bit k of a row or column: one stands between its texels k - 1 and k; bit 0: before the tile's first, bit kTileSize:
/// after its last.
struct TileWalls {
  std::array<std::uint32_t, kTileSize> rows{};
  std::array<std::uint32_t, kTileSize> columns{};
  bool operator==(const TileWalls&) const = default;
  [[nodiscard]] bool any() const { return *this != TileWalls{}; }
};

/// Of texels that hold surface. Looks along whole rows and columns, a quarter of a texel above the surface (and above
/// what a curved one rises over the line), and halves those that are blocked: sixty rays in an open tile of one patch.
/// A stretch of less than six texels of a patch is not looked along. A wall that is lower than that is not seen. A
/// thousand rays at most; what they leave out counts as free.
[[nodiscard]] TileWalls find_walls(const atlas::TileTexels& texels, const trace::RayScene& rays);

/// True if something stands between two points, `lift` above the surface at both. > 0; world units.
[[nodiscard]] bool parted(const trace::RayScene& rays, const trace::Surface& a, const trace::Surface& b, float lift);

/// Calls `wall(k)` for each k in [first, last) that has one between the points k and k + 1 of a line. `clear(a, b)`:
/// nothing stands between points a < b.
template <class Clear, class Wall>
void search_line(int first, int last, const Clear& clear, const Wall& wall) {
  if (last <= first || clear(first, last)) return;
  if (last - first == 1) return wall(first);
  const int middle = first + (last - first) / 2;
  search_line(first, middle, clear, wall);
  search_line(middle, last, clear, wall);
}

}  // namespace darm::renderer
