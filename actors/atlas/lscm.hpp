// Least-squares conformal map of one patch (Levy et al. 2002), the only user of Eigen in this room.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

namespace darm::atlas {

/// Flat position of every vertex, up to similarity, with two far apart vertices pinned. Empty if the system is singular
/// or the result is not finite. Triangles must have positive area. Flips are possible: the caller checks.
[[nodiscard]] std::optional<std::vector<glm::dvec2>> least_squares_conformal_map(
    const std::vector<glm::dvec3>& positions, const std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace darm::atlas
