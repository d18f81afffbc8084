// One chart's triangles as spatially coherent, compressed chunks.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/scene/scene.hpp"
#include "actors/session/bytes.hpp"

namespace darm::session {

/// Triangles of `chart` that have texels, along a Morton curve of their centroids (node space).
[[nodiscard]] std::vector<std::uint32_t> coherent_triangles(const scene::Mesh& mesh, const atlas::Chart& chart);

/// Grids that a chart's numbers are rounded to: powers of two, so that charts of like scale share theirs and edges that
/// met still meet.
struct GridSteps {
  float position = 0;  ///< node space
  float uv = 0;        ///< world units
};

/// Error by rounding, where floats can hold the grid at all: a position moves by at most 1/256 of the finest texel and
/// 2^-19 of the scene's `diagonal` (world units) along each axis, a texture coordinate by 1/128 of a texel. Where a
/// texel is 25 pixels wide, that is a tenth of a pixel. `q`, `diagonal`: > 0.
[[nodiscard]] GridSteps grid_steps(const scene::Mesh& mesh, const atlas::Chart& chart, float stretch, float q,
                                   float diagonal);

struct ChunkGeometry {
  std::uint32_t vertex_count = 0;
  std::uint32_t index_count = 0;
  Bytes vertices;  ///< meshopt vertex buffer, 24 bytes each: i32 position[3], i32 uv[2], u32 local patch
  Bytes indices;   ///< meshopt index buffer
  glm::vec3 bounds_min{0.0f};
  glm::vec3 bounds_max{0.0f};
};

/// Vertices are shared where position, uv and patch are equal; ordered for the vertex cache, then for fetching.
/// `steps`: of grid_steps().
[[nodiscard]] ChunkGeometry encode_chunk(const scene::Mesh& mesh, const atlas::Chart& chart, const GridSteps& steps,
                                         const std::vector<std::uint32_t>& triangles, std::size_t first,
                                         std::size_t count);

/// meshopt vertex buffer of `count` records of `stride` bytes (a multiple of 4, at most 256).
[[nodiscard]] Bytes encode_vertices(const void* records, std::size_t count, std::size_t stride);

}  // namespace darm::session
