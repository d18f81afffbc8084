// Where every patch of the scene lies in the atlas, at every level. Immutable after it is made; the same arithmetic
// runs on the server and, from the tables in the scene manifest, on every client.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <vector>

#include "actors/types/ids.hpp"
#include "actors/types/tile_id.hpp"

namespace darm::atlas {

/// Parameterisation of one mesh (paper 3.1). Triangle i is Mesh::triangles[i].
/// `uv` is in world units within the patch: the patch's bounding box starts at (0, 0).
struct Chart {
  std::uint32_t mesh = 0;
  std::uint32_t patch_count = 0;
  std::vector<std::uint32_t> local_patch;    ///< per triangle; kDropped if the triangle has no texels
  std::vector<std::array<glm::vec2, 3>> uv;  ///< per triangle corner
  std::vector<glm::vec2> patch_size;         ///< per local patch: extent of uv, world units
  std::vector<float> patch_area;             ///< per local patch: world units squared
};
inline constexpr std::uint32_t kDroppedTriangle = 0xffffffffu;

/// Texels of one scene instance: patch = base + local id. Instances that share mesh and stretch share a chart.
struct InstanceCharts {
  std::uint32_t chart = 0;
  std::uint32_t front_base = 0;
  std::uint32_t back_base = 0xffffffffu;  ///< 0xffffffff: single-sided
  [[nodiscard]] bool has_back() const { return back_base != 0xffffffffu; }
};

/// Place of one patch at one level. texel = origin + 0.5 + uv * (scale * density of the level).
/// `scale` is 1, but 0 for a patch under one texel (it becomes exactly one texel) and other for density overrides.
struct Placement {
  std::uint32_t x = 0;
  std::uint32_t y = 0;
  float scale = 1.0f;
};

struct Level {
  float density = 0;        ///< texels per world unit: q / 2^level
  std::uint32_t width = 0;  ///< texels; a whole number of tiles
  std::uint32_t height = 0;
  std::uint32_t tiles_x = 0;
  std::uint32_t tiles_y = 0;
  float occupancy = 0;                ///< surface area * density^2 / (width * height)
  std::vector<Placement> placements;  ///< per patch
};

struct DroppedTriangles {
  std::string reason;
  std::uint64_t count = 0;
};

struct Layout {
  std::uint64_t hash = 0;  ///< of scene geometry, q and the packer's version: the cache key
  float q = 0;
  std::vector<Chart> charts;
  std::vector<InstanceCharts> instances;  ///< parallel to Scene::instances
  std::uint32_t patch_count = 0;
  std::vector<Level> levels;  ///< at least one; the last is CoarseTex
  double surface_area = 0;    ///< world units squared, back sides included
  std::vector<DroppedTriangles> dropped;

  [[nodiscard]] int coarse_level() const { return static_cast<int>(levels.size()) - 1; }

  /// Patch of a triangle seen from its front or back; kNoPatch if it has no texels there.
  [[nodiscard]] PatchId patch_of(std::uint32_t instance, std::uint32_t triangle, bool front) const {
    const auto& ic = instances[instance];
    const auto local = charts[ic.chart].local_patch[triangle];
    if (local == kDroppedTriangle || (!front && !ic.has_back())) return kNoPatch;
    return PatchId{(front ? ic.front_base : ic.back_base) + local};
  }

  /// Position inside the patch, world units, of the point with barycentrics (1 - u - v, u, v) of a triangle.
  [[nodiscard]] glm::vec2 patch_uv(std::uint32_t instance, std::uint32_t triangle, float u, float v) const {
    const auto& c = charts[instances[instance].chart].uv[triangle];
    return c[0] * (1.0f - u - v) + c[1] * u + c[2] * v;
  }

  /// Texel position (continuous; texel (i, j) has its centre at (i + 0.5, j + 0.5)) of a patch position at a level.
  [[nodiscard]] glm::vec2 texel_at(PatchId patch, int level, glm::vec2 uv) const {
    const auto& l = levels[static_cast<std::size_t>(level)];
    const auto& p = l.placements[index_of(patch)];
    return glm::vec2(static_cast<float>(p.x) + 0.5f, static_cast<float>(p.y) + 0.5f) + uv * (p.scale * l.density);
  }

  /// Tile that holds a texel position. The position must lie inside the level.
  [[nodiscard]] TileId tile_at(int level, glm::vec2 texel) const {
    const auto& l = levels[static_cast<std::size_t>(level)];
    const auto tx = static_cast<std::uint32_t>(texel.x) / kTileSize;
    const auto ty = static_cast<std::uint32_t>(texel.y) / kTileSize;
    return TileId(level, ty * l.tiles_x + tx);
  }
};

}  // namespace darm::atlas
