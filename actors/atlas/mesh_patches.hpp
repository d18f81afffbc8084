// Which triangles of a mesh belong together: the patches of paper 3.1, before they are made flat.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <vector>

#include "actors/scene/scene.hpp"

namespace darm::atlas {

/// Connected triangles of one bin, with welded vertices. Index spaces: `triangles` name Mesh::triangles, `corners` name
/// `positions` (metres, stretched node space, relative to the patch's first vertex).
struct RawPatch {
  std::vector<std::uint32_t> triangles;
  std::vector<std::array<std::uint32_t, 3>> corners;
  std::vector<glm::dvec3> positions;
  std::array<float, 3> bin_axis{};  ///< unit axis, one of the six
};

struct MeshPatches {
  std::vector<RawPatch> patches;
  std::uint64_t zero_area = 0;   ///< triangles without a usable area
  std::uint64_t not_finite = 0;  ///< triangles with NaN or infinite corners, or corners that are not there
};

/// Joins triangles that share an edge (by exact position) and the dominant axis of their normal. An edge that is not
/// used by exactly two triangles of the bin, running in opposite directions, does not join. Deterministic: patches are
/// ordered by their first triangle.
[[nodiscard]] MeshPatches find_patches(const scene::Mesh& mesh, const glm::mat3& stretch);

}  // namespace darm::atlas
