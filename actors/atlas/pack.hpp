// Packs the footprints of all patches into one level of the atlas.
#pragma once

#include <cstdint>
#include <vector>

#include "actors/atlas/charts.hpp"
#include "actors/atlas/footprint.hpp"
#include "actors/atlas/layout.hpp"

namespace darm::atlas {

/// Bumped whenever the same scene would be packed in another way: old caches are then refused.
inline constexpr std::uint32_t kPackerVersion = 3;

/// Patches in the order in which the packer fills the strip, in groups that are seen together (near in space, alike in
/// direction). Shared by all levels.
struct PackOrder {
  std::vector<std::uint32_t> patches;   ///< PatchId, in Morton order of (cell of the centroid, bin)
  std::vector<std::uint32_t> shape_of;  ///< per PatchId: index of its footprint, see FootprintSet
};

/// Footprints at one density, one per (chart, local patch): instances and back sides share them.
struct FootprintSet {
  std::vector<Footprint> shapes;
  std::uint64_t texels = 0;  ///< own texels over all patches
};

[[nodiscard]] PackOrder order_patches(const scene::Scene& scene, const Charts& charts);
[[nodiscard]] FootprintSet footprints_at(const Charts& charts, const std::vector<PatchTriangles>& triangles,
                                         const PackOrder& order, float density);

/// Packs one level. Shape-aware first fit: patches of more than a third of a tile go into a strip, big ones first, then
/// group after group, each from its longest patch on, so that holes are filled. Smaller patches, of which a view sees
/// thousands, go in order of place and direction into pages of 2x2 tiles, and the pages into tiles that are still free:
/// a view then touches few tiles for their sake. No texel is owned twice.
[[nodiscard]] Level pack_level(const Charts& charts, const PackOrder& order, const FootprintSet& footprints,
                               float density);

}  // namespace darm::atlas
