// The figures of an atlas that `darmd inspect` prints.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/scene/scene.hpp"

namespace darm::atlas {

struct LevelReport {
  float density = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  float occupancy = 0;
};

struct AtlasReport {
  std::uint32_t patches = 0;
  float q = 0;
  double surface_area = 0;
  float occupancy = 0;  ///< of level 0
  std::vector<LevelReport> levels;
};
[[nodiscard]] AtlasReport report_atlas(const Layout& layout);
/// Triangles that the loader or the layout left out, each with its reason; counts may be 0 (what has no triangles).
[[nodiscard]] std::vector<DroppedTriangles> dropped_triangles(const scene::Scene& scene, const Layout& layout);

/// One bilinear tap of a client's view.
struct Tap {
  PatchId patch = kNoPatch;
  int level = 0;
  glm::vec2 uv{0.0f};  ///< position in the patch, world units
};

struct WorkingSetReport {
  std::uint64_t visible_texels = 0;
  std::uint64_t visible_tiles = 0;
  double efficiency = 0;  ///< visible_texels / (900 * visible_tiles)
};
/// Texels and tiles that the taps read. Taps of kNoPatch are left out.
[[nodiscard]] WorkingSetReport measure_working_set(const Layout& layout, std::span<const Tap> taps);
/// The same under the paper's packing of level 0 (shelf_pack); taps at other levels are counted at level 0 too, since
/// the paper has no others.
[[nodiscard]] WorkingSetReport measure_working_set(const Layout& layout, const Level& paper, std::span<const Tap> taps);

}  // namespace darm::atlas
