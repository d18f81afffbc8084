// A material read at one point of the surface: textures, factors and vertex colours multiplied out.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/vec3.hpp>

#include "actors/renderer/effects.hpp"
#include "actors/renderer/trace/effect_tally.hpp"
#include "actors/renderer/trace/surface.hpp"
#include "actors/scene/scene.hpp"
#include "actors/scene/texture_sampling.hpp"

namespace darm::renderer {

/// Smallest GGX alpha: mirrors are this rough (0.06 degrees), so that every lobe has a density and needs no special
/// case.
inline constexpr float kSmallestAlpha = 1e-3f;

/// 1 - Fresnel towards an eye at `cosine` from the normal, over its view average: (1 - m^5) * 21 / 20 by Schlick's
/// formula, whatever F0.
[[nodiscard]] inline float diffuse_view_factor(float cosine) {
  const float m = std::clamp(1.0f - cosine, 0.0f, 1.0f);
  const float m2 = m * m;
  return (1.0f - m2 * m2 * m) * 1.05f;
}

/// glTF metallic-roughness parameters at a point; all finite, colours >= 0, shares 0..1.
struct MaterialPoint {
  glm::vec3 base{1.0f};
  glm::vec3 emission{0.0f};  ///< radiance of this side, nits; unlit: base colour
  float alpha = 1;           ///< coverage: < 1 only for BLEND
  float metallic = 0;
  float ggx_alpha = 1;  ///< roughness squared, >= kSmallestAlpha
  float f0 = 0.04f;     ///< of the dielectric share, from ior
  float ior = 1.5f;
  float transmission = 0;
  bool thin = true;
  bool unlit = false;
  bool interface = true;  ///< false for ior 1: no boundary, so nothing is reflected by the dielectric share

  /// Light goes straight through: thin and smooth, or a volume without a boundary (ior 1).
  [[nodiscard]] bool passes_straight() const {
    return transmission > 0 && (thin ? ggx_alpha <= kSmallestAlpha : !interface);
  }

  /// Schlick's Fresnel of the dielectric share.
  [[nodiscard]] float fresnel(float cosine) const {
    if (!interface) return 0;
    const float m = std::clamp(1.0f - cosine, 0.0f, 1.0f);
    const float m2 = m * m;
    return f0 + (1.0f - f0) * m2 * m2 * m;
  }

  /// What specular lobes reflect in all, seen from outside: Fresnel's of the dielectric share, Schlick's of the metal.
  [[nodiscard]] glm::vec3 reflectance(float cosine) const {
    const float m = std::clamp(1.0f - cosine, 0.0f, 1.0f);
    const float m5 = m * m * m * m * m;
    const glm::vec3 metal = base + (glm::vec3(1.0f) - base) * m5;
    return glm::vec3((1.0f - metallic) * fresnel(cosine)) + metal * metallic;
  }

  /// What the diffuse lobe reflects, the view averaged out: mean of 1 - F over cosine-weighted outgoing directions,
  /// 1 - F0 - (1 - F0) / 21 for Schlick's formula (analytic: integral of 2 c (1 - c)^5 is 1/21).
  [[nodiscard]] glm::vec3 diffuse_albedo() const {
    if (unlit) return glm::vec3(0.0f);
    const float through = interface ? (1.0f - f0) * (20.0f / 21.0f) : 1.0f;
    return base * ((1.0f - metallic) * (1.0f - transmission) * through);
  }

  /// Weight of what is straight behind, in the view-independent picture: (1 - alpha) + alpha * transmission * tint.
  [[nodiscard]] glm::vec3 view_independent_transparency() const {
    const float clear = thin ? alpha * (1.0f - metallic) * transmission : 0.0f;
    return glm::vec3(1.0f - alpha) + base * clear;
  }

  /// The same for light transport: only what is not scattered, Fresnel included.
  [[nodiscard]] glm::vec3 straight_through(float cosine) const {
    const float clear = passes_straight() ? alpha * (1.0f - metallic) * transmission * (1.0f - fresnel(cosine)) : 0.0f;
    return glm::vec3(1.0f - alpha) + base * clear;
  }
};

/// A point of a triangle: (1 - u - v, u, v).
struct TrianglePoint {
  std::uint32_t triangle;
  float u, v;
};

/// What of a material the effects `fx` look at. `textures` must be of the same point; not looked at without
/// fx.textures. In the header for the integrators, whose inner loops it is part of.
template <Effects fx>
[[nodiscard]] MaterialPoint read_material(const scene::Scene& scene, const trace::WorldInstance& placed,
                                          const TrianglePoint& at, const scene::HitTextures& textures,
                                          EffectTally& tally) {
  using scene::TextureEncoding;
  using Set = scene::TextureSet;
  const auto& m = *placed.material;
  const auto& mesh = *placed.mesh;
  const auto read_rarer = [&](const scene::TextureRef& texture, TextureEncoding encoding) {
    tally.add(EffectKind::kTextures);
    return scene::sample(scene, texture, mesh, at.triangle, at.u, at.v, encoding);
  };
  glm::vec4 base = m.base_color;
  if constexpr (fx.textures) {
    if (textures.has(Set::kBaseColor)) {
      tally.add(EffectKind::kTextures);
      base *= textures.read(Set::kBaseColor, TextureEncoding::kSrgb);
    }
    if (!mesh.colors.empty()) {
      tally.add(EffectKind::kVertexColors);
      base *= scene::interpolate_color(mesh, at.triangle, at.u, at.v);
    }
  }
  MaterialPoint p;
  p.base = glm::clamp(glm::vec3(base), 0.0f, 1.0f);
  if constexpr (fx.straight)
    if (m.alpha_mode == scene::AlphaMode::kBlend) p.alpha = std::clamp(base.w, 0.0f, 1.0f);
  if constexpr (fx.emitters) {
    p.unlit = m.unlit;
    if (m.unlit) {
      p.emission = p.base;
      return p;
    }
  }
  float roughness = m.roughness;
  if constexpr (fx.glossy) p.metallic = m.metallic;
  if constexpr (fx.textures)
    if (textures.has(Set::kMetallicRoughness)) {
      tally.add(EffectKind::kTextures);
      const glm::vec4 texel = textures.read(Set::kMetallicRoughness, TextureEncoding::kLinear);
      roughness *= texel.y;
      if constexpr (fx.glossy) p.metallic *= texel.z;
    }
  p.ggx_alpha = std::max(roughness * roughness, kSmallestAlpha);
  p.ior = m.ior;
  p.interface = fx.glossy && std::abs(m.ior - 1.0f) > 1e-4f;
  const float ratio = (m.ior - 1.0f) / (m.ior + 1.0f);
  p.f0 = ratio * ratio;
  p.thin = m.thickness <= 0;
  if constexpr (fx.transmission) {
    p.transmission = m.transmission;
    if (m.transmission > 0 && m.transmission_texture.present())
      p.transmission *= read_rarer(m.transmission_texture, TextureEncoding::kLinear).x;
  }
  if constexpr (fx.emitters)
    if (m.emits()) {
      p.emission = m.emissive;
      if constexpr (fx.textures)
        if (m.emissive_texture.present())
          p.emission *= glm::vec3(read_rarer(m.emissive_texture, TextureEncoding::kSrgb));
    }
  return p;
}

/// All of it.
[[nodiscard]] MaterialPoint make_material_point(const scene::Scene& scene, const trace::WorldInstance& placed,
                                                std::uint32_t triangle, float u, float v);
[[nodiscard]] inline MaterialPoint make_material_point(const scene::Scene& scene, const trace::Surface& s) {
  return make_material_point(scene, *s.placed, s.triangle, s.u, s.v);
}

/// Emitted radiance only (the cheap part of the above), of a side that emits.
[[nodiscard]] glm::vec3 emitted_radiance(const scene::Scene& scene, const trace::WorldInstance& placed,
                                         std::uint32_t triangle, float u, float v);

/// False if no point of the material has a diffuse lobe, whatever its textures say.
[[nodiscard]] inline bool may_diffuse(const scene::Material& m) {
  const bool metal = m.metallic >= 1.0f && !m.metallic_roughness_texture.present();
  const bool clear = m.transmission >= 1.0f && !m.transmission_texture.present();
  return !m.unlit && !metal && !clear;
}

/// True if rays may pass the material's surface unscattered (BLEND, thin transmission).
[[nodiscard]] inline bool may_pass(const scene::Material& m) {
  return m.alpha_mode == scene::AlphaMode::kBlend || (m.transmission > 0 && m.thickness <= 0);
}

}  // namespace darm::renderer
