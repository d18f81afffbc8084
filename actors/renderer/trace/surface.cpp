#include "actors/renderer/trace/surface.hpp"

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
