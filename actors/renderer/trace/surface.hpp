// From a surface point to the geometry that shading needs: position, normals, tangent frame.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "actors/renderer/trace/ray_scene.hpp"
#include "actors/types/surface_point.hpp"

namespace darm::renderer::trace {

/// World-space geometry of a surface point, seen from the side `front` says. All normals are unit length and lie on
/// that side.
struct Surface {
  glm::vec3 position{0.0f};
  glm::vec3 geometric_normal{0, 0, 1};
  glm::vec3 shading_normal{0, 0, 1};  ///< interpolated; never on the far side of the geometric one
  glm::vec3 normal{0, 0, 1};          ///< shading normal bent by the normal map, if there is one
  float offset = 0;                   ///< distance by which a ray must start off the surface (see spawn_origin)
  float area = 0;                     ///< of the triangle, m2
  const WorldInstance* placed = nullptr;
  std::uint32_t instance = 0;
  std::uint32_t triangle = 0;
  float u = 0;
  float v = 0;
  bool front = true;

  [[nodiscard]] bool has_normal_map() const {
    return placed->textures.entries[scene::TextureSet::kNormal].image != nullptr && !placed->mesh->tangents.empty();
  }
};

namespace detail {

inline constexpr float kOffsetRelative = 4e-6f;  // 34 ulps of the largest coordinate: interpolation and traversal fit
inline constexpr float kOffsetSmallest = 1e-9f;

[[nodiscard]] inline float largest_size(const glm::vec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

[[nodiscard]] inline glm::vec3 unit_or(const glm::vec3& v, const glm::vec3& otherwise) {
  const float square = glm::dot(v, v);
  return square > 1e-30f && square < 1e30f ? v * (1.0f / std::sqrt(square)) : otherwise;
}

}  // namespace detail

/// Geometry at `point`; indices must be in range. Finite for every non-degenerate triangle.
[[nodiscard]] Surface make_surface(const RayScene& scene, const SurfacePoint& point);
[[nodiscard]] inline Surface make_surface(const RayScene& scene, const Hit& hit) {
  return make_surface(scene, SurfacePoint{hit.instance, hit.triangle, hit.u, hit.v, hit.front});
}

/// The same without a look at the normal map: normal == shading_normal. In the header for the integrators, whose
/// inner loops it is part of.
[[nodiscard]] inline Surface make_unbent_surface(const RayScene& scene, const SurfacePoint& point) {
  Surface s;
  s.placed = &scene.instance(point.instance);
  s.instance = point.instance;
  s.triangle = point.triangle;
  s.u = point.u;
  s.v = point.v;
  s.front = point.front;
  const auto& placed = *s.placed;
  const auto& mesh = *placed.mesh;
  const glm::uvec3 corner = mesh.triangles[point.triangle];
  const glm::vec3 weights(1.0f - point.u - point.v, point.u, point.v);
  const glm::vec3 a = placed.positions[corner.x];
  const glm::vec3 b = placed.positions[corner.y];
  const glm::vec3 c = placed.positions[corner.z];
  s.position = a * weights.x + b * weights.y + c * weights.z;
  s.offset =
      detail::kOffsetRelative * std::max({detail::largest_size(a), detail::largest_size(b), detail::largest_size(c)}) +
      detail::kOffsetSmallest;
  const glm::vec3 cross = glm::cross(b - a, c - a);
  const float doubled = std::sqrt(glm::dot(cross, cross));
  s.area = 0.5f * doubled;
  const float side = point.front ? 1.0f : -1.0f;
  s.geometric_normal = doubled > 0 ? cross * (side * placed.handedness / doubled) : glm::vec3(0, 0, 1);
  const glm::vec3 local =
      mesh.normals[corner.x] * weights.x + mesh.normals[corner.y] * weights.y + mesh.normals[corner.z] * weights.z;
  s.shading_normal = detail::unit_or(placed.normal_to_world * local * side, s.geometric_normal);
  // Normals that contradict the face would light it from behind: such a vertex counts as flat.
  if (glm::dot(s.shading_normal, s.geometric_normal) <= 0) s.shading_normal = s.geometric_normal;
  s.normal = s.shading_normal;
  return s;
}

/// Gives a surface that has_normal_map() the normal that its map holds at the point: `texel`, as it was read there, or
/// read now.
void bend_normal(Surface& surface, const glm::vec4& texel);
void bend_normal(Surface& surface, const scene::Scene& scene);

/// Alpha of the base colour (factor * texture * COLOR_0) at a point of an instance, 0..1.
[[nodiscard]] float surface_alpha(const scene::Scene& scene, const WorldInstance& placed, std::uint32_t triangle,
                                  float u, float v);

/// Origin of a ray that leaves `surface` towards `direction`: moved off the plane to the side the ray goes, by a bound
/// of the rounding error of interpolating the triangle's vertices (some ulps of its largest coordinate; the hit
/// distance does not enter since positions are interpolated, not taken from t). After Wächter & Binder, Ray Tracing
/// Gems 1, 6.
[[nodiscard]] inline glm::vec3 spawn_origin(const Surface& surface, const glm::vec3& direction) {
  const float side = glm::dot(surface.geometric_normal, direction) >= 0 ? surface.offset : -surface.offset;
  return surface.position + surface.geometric_normal * side;
}

/// `point`, moved into its triangle by some ray offsets if it lies on an edge (at most a quarter of the height on it).
/// A point of an edge lies in the plane of the wall that meets it there: by rounding, half of its rays begin beyond
/// that.
[[nodiscard]] SurfacePoint off_edges(const RayScene& scene, const SurfacePoint& point);

/// Two unit vectors that make a right-handed frame with unit `n` (Duff et al., JCGT 2017).
inline void make_frame(const glm::vec3& n, glm::vec3& tangent, glm::vec3& bitangent) {
  const float sign = std::copysign(1.0f, n.z);
  const float a = -1.0f / (sign + n.z);
  const float b = n.x * n.y * a;
  tangent = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
  bitangent = {b, sign + n.y * n.y * a, -n.y};
}

}  // namespace darm::renderer::trace
