// Finds out whether a flat patch lies over itself, and cuts it into pieces that do not.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <vector>

namespace darm::atlas {

/// Twice the signed area that a and b span.
[[nodiscard]] inline double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

using FlatTriangle = std::array<glm::dvec2, 3>;

/// Neighbours of each triangle over its three edges (kNoNeighbour where there is none), from shared corner indices.
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> edge_neighbours(
    const std::vector<std::array<std::uint32_t, 3>>& corners);
inline constexpr std::uint32_t kNoNeighbour = 0xffffffffu;

/// Piece number of every triangle, 0 for the first piece. Pieces grow over shared edges from the lowest unused triangle
/// and take a triangle only if it lies over none that the piece has; so one piece means: no overlap. Works in bounded
/// time: where very many triangles crowd one cell, a triangle is refused unseen and begins a piece of its own.
[[nodiscard]] std::vector<std::uint32_t> pieces_without_overlap(
    const std::vector<FlatTriangle>& triangles, const std::vector<std::array<std::uint32_t, 3>>& neighbours);

}  // namespace darm::atlas
