#include "actors/renderer/trace/surface.hpp"

#include "actors/scene/texture_sampling.hpp"

namespace darm::renderer::trace {
namespace {

constexpr float kOffsetRelative = 4e-6f;  // 34 ulps of the largest coordinate: interpolation and traversal both fit
constexpr float kOffsetSmallest = 1e-9f;

float largest(const glm::vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

glm::vec3 unit_or(const glm::vec3& v, const glm::vec3& otherwise) {
  const float square = glm::dot(v, v);
  return square > 1e-30f && square < 1e30f ? v * (1.0f / std::sqrt(square)) : otherwise;
}

// The normal map's normal in the tangent frame of the vertices, on the side of `shading`.
glm::vec3 bend_normal(const scene::Scene& scene, const WorldInstance& placed, const glm::uvec3& corner,
                      const Surface& s, const glm::vec3& weights, float side) {
  const auto& mesh = *placed.mesh;
  const auto& material = *placed.material;
  const glm::vec4 t =
      mesh.tangents[corner.x] * weights.x + mesh.tangents[corner.y] * weights.y + mesh.tangents[corner.z] * weights.z;
  const glm::vec3 normal = s.shading_normal * side;  // as the file means it: the front's
  glm::vec3 tangent = placed.tangent_to_world * glm::vec3(t);
  tangent -= normal * glm::dot(normal, tangent);
  const float square = glm::dot(tangent, tangent);
  if (!(square > 1e-20f)) return s.shading_normal;
  tangent *= 1.0f / std::sqrt(square);
  const glm::vec3 bitangent = glm::cross(normal, tangent) * (t.w < 0 ? -placed.handedness : placed.handedness);
  const glm::vec4 texel =
      scene::sample(scene, material.normal_texture, mesh, s.triangle, s.u, s.v, scene::TextureEncoding::kLinear);
  const glm::vec3 local((texel.x * 2.0f - 1.0f) * material.normal_scale,
                        (texel.y * 2.0f - 1.0f) * material.normal_scale, texel.z * 2.0f - 1.0f);
  return unit_or(tangent * local.x + bitangent * local.y + normal * local.z, normal) * side;
}

}  // namespace

Surface make_surface(const RayScene& scene, const SurfacePoint& point) {
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
  s.offset = kOffsetRelative * std::max({largest(a), largest(b), largest(c)}) + kOffsetSmallest;
  const glm::vec3 cross = glm::cross(b - a, c - a);
  const float doubled = std::sqrt(glm::dot(cross, cross));
  s.area = 0.5f * doubled;
  const float side = point.front ? 1.0f : -1.0f;
  s.geometric_normal = doubled > 0 ? cross * (side * placed.handedness / doubled) : glm::vec3(0, 0, 1);
  const glm::vec3 local =
      mesh.normals[corner.x] * weights.x + mesh.normals[corner.y] * weights.y + mesh.normals[corner.z] * weights.z;
  s.shading_normal = unit_or(placed.normal_to_world * local * side, s.geometric_normal);
  // Normals that contradict the face would light it from behind: such a vertex counts as flat.
  if (glm::dot(s.shading_normal, s.geometric_normal) <= 0) s.shading_normal = s.geometric_normal;
  s.normal = s.shading_normal;
  if (placed.material->normal_texture.present() && !mesh.tangents.empty())
    s.normal = bend_normal(scene.scene(), placed, corner, s, weights, side);
  return s;
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
