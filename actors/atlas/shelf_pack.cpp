#include "actors/atlas/shelf_pack.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "actors/atlas/footprint.hpp"

namespace darm::atlas {
namespace {

struct Box {
  std::uint32_t patch;
  std::uint32_t width;
  std::uint32_t height;
};

std::vector<Box> boxes_of(const Layout& layout) {
  const Level& finest = layout.levels.front();
  std::vector<Box> out;
  out.reserve(layout.patch_count);
  for (const auto& use : layout.instances) {
    const auto& chart = layout.charts[use.chart];
    for (const auto base : {use.front_base, use.back_base}) {
      if (base == 0xffffffffu) continue;
      for (std::uint32_t p = 0; p < chart.patch_count; ++p) {
        const glm::vec2 size = chart.patch_size[p] * (finest.density * finest.placements[base + p].scale);
        const auto own = [](float extent) {
          return static_cast<std::uint32_t>(std::ceil(extent + kFootprintMargin)) + 1;
        };
        const bool single = finest.placements[base + p].scale == 0;
        out.push_back({base + p, single ? 1 : own(size.x), single ? 1 : own(size.y)});
      }
    }
  }
  std::stable_sort(out.begin(), out.end(), [](const Box& a, const Box& b) { return a.height > b.height; });
  return out;
}

/// Puts the boxes on shelves of a square; false if they do not fit.
bool fill_shelves(const std::vector<Box>& boxes, std::uint64_t side, Level& level) {
  std::uint64_t x = 0, y = 0, shelf = 0;
  for (const auto& b : boxes) {
    if (x + b.width > side) y += shelf, x = 0, shelf = 0;
    if (b.width > side || y + b.height > side) return false;
    if (shelf == 0) shelf = b.height;
    level.placements[b.patch].x = static_cast<std::uint32_t>(x);
    level.placements[b.patch].y = static_cast<std::uint32_t>(y);
    x += b.width;
  }
  return true;
}

}  // namespace

Level shelf_pack(const Layout& layout) {
  Level level;
  level.density = layout.levels.front().density;
  level.placements = layout.levels.front().placements;  // keeps the scales
  const auto boxes = boxes_of(layout);
  std::uint64_t side = 1;
  while (!fill_shelves(boxes, side, level)) side *= 2;
  level.width = level.height = static_cast<std::uint32_t>(side);
  level.tiles_x = level.tiles_y = static_cast<std::uint32_t>((side + kTileSize - 1) / kTileSize);
  level.occupancy = static_cast<float>(layout.surface_area * level.density * level.density /
                                       (static_cast<double>(side) * static_cast<double>(side)));
  return level;
}

}  // namespace darm::atlas
