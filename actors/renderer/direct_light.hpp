// Light that reaches a surface straight from suns, lamps and emissive surfaces. A template over the scene's effects.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <span>

#include "actors/renderer/bsdf.hpp"
#include "actors/renderer/integrator.hpp"
#include "actors/renderer/material_point.hpp"
#include "actors/renderer/sampling.hpp"

namespace darm::renderer {

namespace detail {

inline constexpr int kMostLayers = 256;           // surfaces one straight ray may pass through
inline constexpr float kShortOfTarget = 0.9999f;  // shadow rays end before the lamp they aim at
inline constexpr std::size_t kSunsEach = 4;       // up to so many suns get a shadow ray each; of more, one is drawn
inline constexpr std::size_t kMostPicks = 4;      // lamps drawn at the first vertex, where their noise is seen directly

[[nodiscard]] inline float largest(const glm::vec3& v) { return std::max({v.x, v.y, v.z}); }

}  // namespace detail

/// Numbers to draw and counts to keep, of one sample.
struct Walk {
  explicit Walk(Sampler& s) : sampler(s), tally(thread_tally()) {}
  Sampler& sampler;
  EffectTally& tally;
};

/// The first vertex of view-independent light: white Lambert about the bent normal, cut off at the surface. Albedo
/// comes in at the end, so that a sample's path does not depend on it.
struct DiffuseScatter {
  static constexpr bool kSunByDirection = false;  // its suns come from shadow rays alone
  const trace::Surface& surface;

  [[nodiscard]] glm::vec3 evaluate(const glm::vec3& wi, float& pdf) const {
    const float cosine = glm::dot(surface.normal, wi);
    pdf = 0;
    if (cosine <= 0 || glm::dot(surface.geometric_normal, wi) <= 0) return glm::vec3(0.0f);
    pdf = cosine * kInversePi;
    return glm::vec3(pdf);
  }
  [[nodiscard]] const glm::vec3& normal() const { return surface.normal; }
  [[nodiscard]] bool transmits() const { return false; }
};

template <Effects fx>
struct BsdfScatter : BasicBsdf<fx.glossy, fx.transmission> {
  static constexpr bool kSunByDirection = true;
  using BasicBsdf<fx.glossy, fx.transmission>::BasicBsdf;
};

/// `Scatter` is DiffuseScatter or BsdfScatter: evaluate(), normal(), transmits().
template <Effects fx>
class DirectLight {
 public:
  explicit DirectLight(std::shared_ptr<const TransportWorld> world)
      : world_(std::move(world)), scene_(*world_->scene), rays_(*world_->rays), lights_(world_->lights) {}

 protected:
  /// The surface of a hit or of a texel's point, its normal bent.
  [[nodiscard]] trace::Surface surface_at(const SurfacePoint& point, Walk& walk) const {
    trace::Surface s = trace::make_unbent_surface(rays_, point);
    if constexpr (fx.normal_maps)
      if (s.has_normal_map()) {
        walk.tally.add(EffectKind::kNormalMaps);
        trace::bend_normal(s, scene_);
      }
    return s;
  }

  [[nodiscard]] MaterialPoint material_at(const trace::Surface& s, const scene::HitTextures& textures,
                                          Walk& walk) const {
    return read_material<fx>(scene_, *s.placed, {s.triangle, s.u, s.v}, textures, walk.tally);
  }
  /// Not in the inner loops: looks for the textures itself.
  [[nodiscard]] MaterialPoint material_at(const trace::Surface& s, Walk& walk) const {
    static const scene::TextureSet kNone;
    return material_at(
        s, scene::HitTextures(fx.textures ? s.placed->textures : kNone, *s.placed->mesh, s.triangle, s.u, s.v), walk);
  }

  /// Share of light that reaches `s` along `direction` (not unit: up to `target`, if given).
  [[nodiscard]] glm::vec3 visibility(const trace::Surface& s, const glm::vec3& direction, const glm::vec3* target,
                                     Walk& walk) const {
    trace::Ray ray;
    ray.origin = trace::spawn_origin(s, direction);
    ray.direction = target != nullptr ? *target - ray.origin : direction;
    if (target != nullptr) ray.tmax = detail::kShortOfTarget;
    if constexpr (!fx.straight)
      return glm::vec3(rays_.occluded(ray) ? 0.0f : 1.0f);
    else
      return share_passed(ray, target, walk);
  }

  /// Directional lights: up to kSunsEach each, else one of them.
  template <class Scatter>
  [[nodiscard]] glm::vec3 suns_at(const trace::Surface& s, const Scatter& scatter, Walk& walk) const {
    const auto& suns = lights_.suns();
    if (!fx.suns || suns.empty()) return glm::vec3(0.0f);
    glm::vec3 sum(0.0f);
    const bool each = suns.size() <= detail::kSunsEach;
    const std::size_t first =
        each ? 0
             : std::min(static_cast<std::size_t>(walk.sampler.next_1d() * static_cast<float>(suns.size())),
                        suns.size() - 1);
    const std::size_t end = each ? suns.size() : first + 1;
    const float scale = each ? 1.0f : static_cast<float>(suns.size());
    for (std::size_t i = first; i < end; ++i) {
      const SunLight& sun = suns[i];
      glm::vec3 wi = sun.towards;
      glm::vec3 light = sun.irradiance;
      float pdf = 0;
      walk.tally.add(sun.is_disc() ? EffectKind::kAreaLights : EffectKind::kDeltaLights);
      if (sun.is_disc()) {
        const glm::vec3 d = sample_cap(walk.sampler.next_2d(), sun.chord2);
        wi = glm::normalize(sun.tangent * d.x + sun.bitangent * d.y + sun.towards * d.z);
        light = sun.radiance / sun.pdf();
      }
      const glm::vec3 f = scatter.evaluate(wi, pdf);
      if (detail::largest(f) <= 0) continue;
      const float weight = Scatter::kSunByDirection && sun.is_disc() ? mis_weight(sun.pdf() / scale, pdf) : 1.0f;
      sum += f * light * visibility(s, wi, nullptr, walk) * (weight * scale);
    }
    return sum;
  }

  /// Point and spot lights: `picks` of them.
  template <class Scatter>
  [[nodiscard]] glm::vec3 lamps_at(const trace::Surface& s, const Scatter& scatter, Walk& walk,
                                   std::size_t picks) const {
    if (!fx.lamps || !lights_.has_punctual()) return glm::vec3(0.0f);
    std::array<PunctualDraw, detail::kMostPicks> draws;
    const std::size_t made = lights_.draw_punctual(s.position, scatter.normal(), scatter.transmits(),
                                                   walk.sampler.next_1d(), std::span(draws).first(picks));
    glm::vec3 sum(0.0f);
    for (const auto& light : std::span(draws).first(made)) {
      walk.tally.add(EffectKind::kDeltaLights);
      if (detail::largest(light.irradiance) <= 0) continue;
      const glm::vec3 to = light.position - s.position;
      const float square = glm::dot(to, to);
      if (!(square > 1e-20f)) continue;
      float pdf = 0;
      const glm::vec3 f = scatter.evaluate(to * (1.0f / std::sqrt(square)), pdf);
      if (detail::largest(f) > 0) sum += f * light.irradiance * visibility(s, to, &light.position, walk);
    }
    return sum;
  }

  /// A point on an emissive surface, against directions that find it by chance.
  template <class Scatter>
  [[nodiscard]] glm::vec3 emitters_at(const trace::Surface& s, const Scatter& scatter, Walk& walk) const {
    const auto strategy = world_->options.emitters;
    if (!fx.emitters || !lights_.has_emitters() || strategy == TransportOptions::Emitters::kByDirection)
      return glm::vec3(0.0f);
    walk.tally.add(EffectKind::kAreaLights);
    const float pick = walk.sampler.next_1d();
    const EmitterDraw light = lights_.draw_emitter(pick, walk.sampler.next_2d());
    if (!(light.pdf_area > 0) || detail::largest(light.radiance) <= 0) return glm::vec3(0.0f);
    const glm::vec3 to = light.position - s.position;
    const float square = glm::dot(to, to);
    if (!(square > 1e-20f)) return glm::vec3(0.0f);
    const glm::vec3 wi = to * (1.0f / std::sqrt(square));
    float cosine = -glm::dot(light.normal, wi);
    if (light.double_sided) cosine = std::abs(cosine);
    if (!(cosine > 1e-6f)) return glm::vec3(0.0f);
    float pdf = 0;
    const glm::vec3 f = scatter.evaluate(wi, pdf);
    if (detail::largest(f) <= 0) return glm::vec3(0.0f);
    const float light_pdf = light.pdf_area * square / cosine;
    const float weight = strategy == TransportOptions::Emitters::kBoth ? mis_weight(light_pdf, pdf) : 1.0f;
    return f * light.radiance * visibility(s, to, &light.position, walk) * (weight / light_pdf);
  }

 private:
  [[nodiscard]] glm::vec3 share_passed(trace::Ray ray, const glm::vec3* target, Walk& walk) const {
    glm::vec3 share(1.0f);
    const glm::vec3 unit = glm::normalize(ray.direction);
    trace::Hit hit;
    for (int layer = 0; layer < detail::kMostLayers; ++layer) {
      if (!rays_.closest(ray, hit)) return share;
      walk.tally.add(EffectKind::kBlending);
      if (!may_pass(*rays_.instance(hit.instance).material)) return glm::vec3(0.0f);
      const auto passed = surface_at({hit.instance, hit.triangle, hit.u, hit.v, hit.front}, walk);
      const auto material = material_at(passed, walk);
      share *= material.straight_through(std::abs(glm::dot(passed.normal, unit)));
      if (detail::largest(share) <= 0) return glm::vec3(0.0f);
      ray.origin = trace::spawn_origin(passed, unit);
      if (target != nullptr) ray.direction = *target - ray.origin;
      // The lamp itself may be such a layer: stop when what is left no longer points ahead.
      if (glm::dot(ray.direction, unit) <= 0) return share;
    }
    return glm::vec3(0.0f);
  }

  std::shared_ptr<const TransportWorld> world_;

 protected:
  const scene::Scene& scene_;
  const trace::RayScene& rays_;
  const LightSet& lights_;
  [[nodiscard]] const TransportOptions& options() const { return world_->options; }
};

}  // namespace darm::renderer
