#include "actors/renderer/material_point.hpp"

#include <cmath>

#include "actors/scene/texture_sampling.hpp"

namespace darm::renderer {
namespace {

using scene::TextureEncoding;

// Texture coordinates of a point, each set interpolated at most once.
class TexturePoint {
 public:
  TexturePoint(const scene::Scene& scene, const scene::Mesh& mesh, std::uint32_t triangle, float u, float v)
      : scene_(scene), mesh_(mesh), triangle_(triangle), u_(u), v_(v) {}

  glm::vec4 read(const scene::TextureRef& texture, TextureEncoding encoding) {
    if (texture.uv_set != held_) {
      held_ = texture.uv_set;
      uv_ = scene::interpolate_uv(mesh_, texture.uv_set, triangle_, u_, v_);
    }
    return scene::sample_at(scene_, texture, uv_, encoding);
  }

 private:
  const scene::Scene& scene_;
  const scene::Mesh& mesh_;
  std::uint32_t triangle_;
  float u_, v_;
  glm::vec2 uv_{0.0f};
  int held_ = -1;
};

}  // namespace

MaterialPoint make_material_point(const scene::Scene& scene, const trace::WorldInstance& placed, std::uint32_t triangle,
                                  float u, float v) {
  const auto& m = *placed.material;
  const auto& mesh = *placed.mesh;
  TexturePoint textures(scene, mesh, triangle, u, v);
  glm::vec4 base = m.base_color;
  if (m.base_color_texture.present()) base *= textures.read(m.base_color_texture, TextureEncoding::kSrgb);
  if (!mesh.colors.empty()) base *= scene::interpolate_color(mesh, triangle, u, v);
  MaterialPoint p;
  p.base = glm::clamp(glm::vec3(base), 0.0f, 1.0f);
  if (m.alpha_mode == scene::AlphaMode::kBlend) p.alpha = std::clamp(base.w, 0.0f, 1.0f);
  p.unlit = m.unlit;
  if (m.unlit) {
    p.emission = p.base;
    return p;
  }
  p.metallic = m.metallic;
  float roughness = m.roughness;
  if (m.metallic_roughness_texture.present()) {
    const glm::vec4 texel = textures.read(m.metallic_roughness_texture, TextureEncoding::kLinear);
    roughness *= texel.y;
    p.metallic *= texel.z;
  }
  p.ggx_alpha = std::max(roughness * roughness, kSmallestAlpha);
  p.ior = m.ior;
  p.interface = std::abs(m.ior - 1.0f) > 1e-4f;
  const float ratio = (m.ior - 1.0f) / (m.ior + 1.0f);
  p.f0 = ratio * ratio;
  p.transmission = m.transmission;
  if (m.transmission > 0 && m.transmission_texture.present())
    p.transmission *= textures.read(m.transmission_texture, TextureEncoding::kLinear).x;
  p.thin = m.thickness <= 0;
  if (m.emits()) {
    p.emission = m.emissive;
    if (m.emissive_texture.present())
      p.emission *= glm::vec3(textures.read(m.emissive_texture, TextureEncoding::kSrgb));
  }
  return p;
}

glm::vec3 emitted_radiance(const scene::Scene& scene, const trace::WorldInstance& placed, std::uint32_t triangle,
                           float u, float v) {
  const auto& m = *placed.material;
  if (!m.emissive_texture.present()) return m.emissive;
  return m.emissive *
         glm::vec3(scene::sample(scene, m.emissive_texture, *placed.mesh, triangle, u, v, TextureEncoding::kSrgb));
}

}  // namespace darm::renderer
