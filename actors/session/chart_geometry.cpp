#include "actors/session/chart_geometry.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <utility>

#include "proto/limits.hpp"

namespace darm::session {
namespace {

struct Vertex {
  std::int32_t position[3];
  std::int32_t uv[2];
  std::uint32_t patch;
};
static_assert(sizeof(Vertex) == proto::kVertexBytes);

// Ten bits spread to every third.
std::uint32_t spread(std::uint32_t v) {
  v = (v | (v << 16)) & 0x030000ffu;
  v = (v | (v << 8)) & 0x0300f00fu;
  v = (v | (v << 4)) & 0x030c30c3u;
  v = (v | (v << 2)) & 0x09249249u;
  return v;
}

// The largest power of two that is at most `wanted`, but for numbers up to `largest` so large that their place on the
// grid has at most the 24 bits of a float.
float power_of_two_step(float wanted, float largest) {
  const int wanted_exponent = std::ilogb(std::clamp(wanted, 1e-30f, 1e30f));
  const int float_exponent = largest > 0 ? std::ilogb(largest) - 23 : wanted_exponent;
  return std::ldexp(1.0f, std::max(wanted_exponent, float_exponent));
}

std::int32_t on_grid(float value, float step) { return static_cast<std::int32_t>(std::lround(value / step)); }

}  // namespace

GridSteps grid_steps(const scene::Mesh& mesh, const atlas::Chart& chart, float stretch, float q, float diagonal) {
  float farthest = 0;
  for (const auto& p : mesh.positions) farthest = std::max({farthest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  float largest_uv = 0;
  for (const auto& triangle : chart.uv)
    for (const auto& uv : triangle) largest_uv = std::max({largest_uv, std::abs(uv.x), std::abs(uv.y)});
  const float texel = 1.0f / q;
  const float world = std::min(texel / 128.0f, diagonal / 262144.0f);
  return {power_of_two_step(world / std::max(stretch, 1e-20f), farthest), power_of_two_step(texel / 64.0f, largest_uv)};
}

std::vector<std::uint32_t> coherent_triangles(const scene::Mesh& mesh, const atlas::Chart& chart) {
  glm::vec3 low(INFINITY);
  glm::vec3 high(-INFINITY);
  for (const auto& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const glm::vec3 extent = glm::max(high - low, glm::vec3(1e-30f));
  std::vector<std::pair<std::uint32_t, std::uint32_t>> keyed;
  keyed.reserve(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (chart.local_patch[t] == atlas::kDroppedTriangle) continue;
    const auto& i = mesh.triangles[t];
    const glm::vec3 center = (mesh.positions[i.x] + mesh.positions[i.y] + mesh.positions[i.z]) / 3.0f;
    const glm::vec3 unit = glm::clamp((center - low) / extent, 0.0f, 1.0f) * 1023.0f;
    const auto code = spread(static_cast<std::uint32_t>(unit.x)) | (spread(static_cast<std::uint32_t>(unit.y)) << 1) |
                      (spread(static_cast<std::uint32_t>(unit.z)) << 2);
    keyed.emplace_back(code, t);
  }
  std::sort(keyed.begin(), keyed.end());
  std::vector<std::uint32_t> order(keyed.size());
  std::transform(keyed.begin(), keyed.end(), order.begin(), [](const auto& k) { return k.second; });
  return order;
}

Bytes encode_vertices(const void* records, std::size_t count, std::size_t stride) {
  Bytes out(meshopt_encodeVertexBufferBound(count, stride));
  out.resize(meshopt_encodeVertexBuffer(out.data(), out.size(), records, count, stride));
  return out;
}

ChunkGeometry encode_chunk(const scene::Mesh& mesh, const atlas::Chart& chart, const GridSteps& steps,
                           const std::vector<std::uint32_t>& triangles, std::size_t first, std::size_t count) {
  ChunkGeometry out;
  out.bounds_min = glm::vec3(INFINITY);
  out.bounds_max = glm::vec3(-INFINITY);
  std::vector<Vertex> corners;
  corners.reserve(count * 3);
  for (std::size_t k = first; k < first + count; ++k) {
    const auto t = triangles[k];
    for (int c = 0; c < 3; ++c) {
      const auto& p = mesh.positions[mesh.triangles[t][c]];
      const auto& uv = chart.uv[t][static_cast<std::size_t>(c)];
      corners.push_back({{on_grid(p.x, steps.position), on_grid(p.y, steps.position), on_grid(p.z, steps.position)},
                         {on_grid(uv.x, steps.uv), on_grid(uv.y, steps.uv)},
                         chart.local_patch[t]});
      out.bounds_min = glm::min(out.bounds_min, p);
      out.bounds_max = glm::max(out.bounds_max, p);
    }
  }
  std::vector<unsigned> remap(corners.size());
  const auto unique = meshopt_generateVertexRemap(remap.data(), nullptr, corners.size(), corners.data(), corners.size(),
                                                  sizeof(Vertex));
  std::vector<Vertex> vertices(unique);
  meshopt_remapVertexBuffer(vertices.data(), corners.data(), corners.size(), sizeof(Vertex), remap.data());
  std::vector<unsigned> indices(remap.size());
  meshopt_optimizeVertexCache(indices.data(), remap.data(), remap.size(), unique);
  std::vector<Vertex> fetched(unique);
  meshopt_optimizeVertexFetch(fetched.data(), indices.data(), indices.size(), vertices.data(), unique, sizeof(Vertex));
  out.vertex_count = static_cast<std::uint32_t>(unique);
  out.index_count = static_cast<std::uint32_t>(indices.size());
  out.vertices = encode_vertices(fetched.data(), unique, sizeof(Vertex));
  out.indices.resize(meshopt_encodeIndexBufferBound(indices.size(), unique));
  out.indices.resize(meshopt_encodeIndexBuffer(out.indices.data(), out.indices.size(), indices.data(), indices.size()));
  return out;
}

}  // namespace darm::session
