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

struct ChunkGeometry {
  std::uint32_t vertex_count = 0;
  std::uint32_t index_count = 0;
  Bytes vertices;  ///< meshopt vertex buffer, 24 bytes each: f32 position[3], f32 uv[2], u32 local patch
  Bytes indices;   ///< meshopt index buffer
  glm::vec3 bounds_min{0.0f};
  glm::vec3 bounds_max{0.0f};
};

/// Vertices are shared where position, uv and patch are equal; ordered for the vertex cache, then for fetching.
[[nodiscard]] ChunkGeometry encode_chunk(const scene::Mesh& mesh, const atlas::Chart& chart,
                                         const std::vector<std::uint32_t>& triangles, std::size_t first,
                                         std::size_t count);

/// meshopt vertex buffer of `count` records of `stride` bytes (a multiple of 4, at most 256).
[[nodiscard]] Bytes encode_vertices(const void* records, std::size_t count, std::size_t stride);

}  // namespace darm::session
