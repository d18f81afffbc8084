#include "actors/renderer/trace/surface.hpp"

#include <array>

#include "actors/scene/texture_sampling.hpp"

namespace darm::renderer::trace {

void bend_normal(Surface& s, const glm::vec4& texel) {
  const auto& placed = *s.placed;
  const auto& mesh = *placed.mesh;
  const glm::uvec3 corner = mesh.triangles[s.triangle];
  const float side = s.front ? 1.0f : -1.0f;
  const glm::vec4 t =
      mesh.tangents[corner.x] * (1.0f - s.u - s.v) + mesh.tangents[corner.y] * s.u + mesh.tangents[corner.z] * s.v;
  const glm::vec3 normal = s.shading_normal * side;  // as the file means it: the front's
  glm::vec3 tangent = placed.tangent_to_world * glm::vec3(t);
  tangent -= normal * glm::dot(normal, tangent);
  const float square = glm::dot(tangent, tangent);
  if (!(square > 1e-20f)) return;
  tangent *= 1.0f / std::sqrt(square);
  const glm::vec3 bitangent = glm::cross(normal, tangent) * (t.w < 0 ? -placed.handedness : placed.handedness);
  const float scale = placed.material->normal_scale;
  const glm::vec3 local((texel.x * 2.0f - 1.0f) * scale, (texel.y * 2.0f - 1.0f) * scale, texel.z * 2.0f - 1.0f);
  s.normal = detail::unit_or(tangent * local.x + bitangent * local.y + normal * local.z, normal) * side;
}

void bend_normal(Surface& s, const scene::Scene& scene) {
  bend_normal(s, scene::sample(scene, s.placed->material->normal_texture, *s.placed->mesh, s.triangle, s.u, s.v,
                               scene::TextureEncoding::kLinear));
}

Surface make_surface(const RayScene& scene, const SurfacePoint& point) {
  Surface s = make_unbent_surface(scene, point);
  if (s.has_normal_map()) bend_normal(s, scene.scene());
  return s;
}

SurfacePoint off_edges(const RayScene& scene, const SurfacePoint& point) {
  constexpr float kOnEdge = 1e-5f;  // barycentric: clamping leaves zero or a rounding error
  constexpr float kRayOffsets = 8;  // the wall's own rounding, and rays that leave at a slant
  constexpr float kMostOfHeight = 0.25f;
  glm::vec3 weights(1.0f - point.u - point.v, point.u, point.v);
  if (std::min({weights.x, weights.y, weights.z}) > kOnEdge) return point;
  const Surface s = make_unbent_surface(scene, point);
  const glm::uvec3 corner = s.placed->mesh->triangles[point.triangle];
  const std::array<glm::vec3, 3> at{s.placed->positions[corner.x], s.placed->positions[corner.y],
                                    s.placed->positions[corner.z]};
  for (int i = 0; i < 3; ++i) {
    const glm::vec3 edge = at[static_cast<std::size_t>((i + 2) % 3)] - at[static_cast<std::size_t>((i + 1) % 3)];
    const float length = std::sqrt(glm::dot(edge, edge));
    // Distance over height; height = 2 area / edge. NaN, of a triangle without area, is the most there may be.
    const float share = kRayOffsets * s.offset * length / (2 * s.area);
    weights[i] = std::max(weights[i], share < kMostOfHeight ? share : kMostOfHeight);
  }
  weights /= weights.x + weights.y + weights.z;
  SurfacePoint moved = point;
  moved.u = weights.y;
  moved.v = std::min(weights.z, 1.0f - weights.y);
  return moved;
}

float surface_alpha(const scene::Scene& scene, const WorldInstance& placed, std::uint32_t triangle, float u, float v) {
  const auto& mesh = *placed.mesh;
  const auto& material = *placed.material;
  float alpha = material.base_color.w;
  if (material.base_color_texture.present())
    alpha *= scene::sample(scene, material.base_color_texture, mesh, triangle, u, v, scene::TextureEncoding::kLinear).w;
  if (!mesh.colors.empty()) {
    const auto corner = mesh.triangles[triangle];
    alpha *= mesh.colors[corner.x].w * (1.0f - u - v) + mesh.colors[corner.y].w * u + mesh.colors[corner.z].w * v;
  }
  return alpha;
}

}  // namespace darm::renderer::trace
