// Makes a patch flat: the parameterisation of paper 3.1, with its ways out.
#pragma once

#include <cstdint>
#include <vector>

#include "actors/atlas/mesh_patches.hpp"
#include "actors/atlas/overlap.hpp"

namespace darm::atlas {

/// A flat patch without flips and overlaps. Positions are metres; the bounding box starts at (0, 0), is as small as
/// possible, and its long side is y. The flat area equals the area of the triangles in space.
struct FlatPatch {
  std::vector<std::uint32_t> triangles;  ///< Mesh::triangles
  std::vector<FlatTriangle> uv;          ///< parallel to `triangles`
  glm::dvec2 size{0.0};
  double area = 0;
};

/// Patches with more triangles than this are not given to the sparse solver.
inline constexpr std::size_t kMaxConformalTriangles = 30000;

/// Nearly planar patches are projected on their plane (which is their conformal map); others get the least-squares
/// conformal map; where that flips, overlaps or stretches too much, the projection along the mean normal or the bin's
/// axis, cut where it lies over itself. Always ends with every triangle in exactly one result.
[[nodiscard]] std::vector<FlatPatch> flatten(const RawPatch& patch);

}  // namespace darm::atlas
