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
};

/// Geometry at `point`; indices must be in range. Finite for every non-degenerate triangle.
[[nodiscard]] Surface make_surface(const RayScene& scene, const SurfacePoint& point);
[[nodiscard]] inline Surface make_surface(const RayScene& scene, const Hit& hit) {
  return make_surface(scene, SurfacePoint{hit.instance, hit.triangle, hit.u, hit.v, hit.front});
}

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

/// Two unit vectors that make a right-handed frame with unit `n` (Duff et al., JCGT 2017).
inline void make_frame(const glm::vec3& n, glm::vec3& tangent, glm::vec3& bitangent) {
  const float sign = std::copysign(1.0f, n.z);
  const float a = -1.0f / (sign + n.z);
  const float b = n.x * n.y * a;
  tangent = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
  bitangent = {b, sign + n.y * n.y * a, -n.y};
}

}  // namespace darm::renderer::trace
