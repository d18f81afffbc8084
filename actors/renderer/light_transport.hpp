// How light travels: the one definition of view-independent light, used by reference and atlas alike.
#pragma once

#include <glm/vec3.hpp>
#include <memory>

#include "actors/renderer/bsdf.hpp"
#include "actors/renderer/integrator.hpp"
#include "actors/renderer/material_point.hpp"
#include "actors/renderer/trace/ray_scene.hpp"
#include "actors/scene/effect_plan.hpp"
#include "actors/scene/scene.hpp"
#include "actors/types/surface_point.hpp"

namespace darm::renderer {

/// Path tracing with next-event estimation and MIS (power heuristic). Stateless: thread-safe, results depend on the
/// arguments alone. The scene's effect plan chooses, once, the integrator whose code holds what it calls for; the light
/// is the same as with everything on, bit by bit. A scene that has changed is a new Scene and needs a new
/// LightTransport. Rules: shadow and bounce rays that meet the back of a single-sided triangle are blocked and see
/// black, but for the share that BLEND or clear material lets through, and for the inside of refracting volumes.
/// Refracting volumes block shadow rays; light crosses them on sampled paths.
class LightTransport {
 public:
  LightTransport(std::shared_ptr<const scene::Scene> scene, std::shared_ptr<const trace::RayScene> rays,
                 TransportOptions options = {});

  /// One unbiased sample of the light that leaves `point` whatever the eye: emission + diffuse_albedo / pi * E(n).
  [[nodiscard]] ViewIndependentLight view_independent(const SurfacePoint& point, Sampler& sampler) const;

  /// The two parts of irradiance() / pi, nits, each by itself: what a white surface would send back. 0 where the
  /// material has no diffuse lobe anywhere. Sharp light takes shadow rays alone and is the cheap one.
  [[nodiscard]] glm::vec3 sharp_light(const SurfacePoint& point, Sampler& sampler) const;
  /// Unbiased without `stored`. With it paths end at the first diffuse surface whose light is stored (after Ward et
  /// al., A Ray Tracing Solution for Diffuse Interreflection, 1988, with texels for samples): half the time, and as
  /// exact as the stored light; what mirrors and coats add goes on.
  [[nodiscard]] glm::vec3 soft_light(const SurfacePoint& point, Sampler& sampler,
                                     const StoredLight* stored = nullptr) const;

  /// One unbiased sample of the irradiance E(n), lux, of the side `point` names (n: normal-mapped), split as above, no
  /// albedo. view_independent == emission(point) + diffuse_albedo(point) / pi * irradiance(point), sample by sample.
  [[nodiscard]] ViewIndependentLight irradiance(const SurfacePoint& point, Sampler& sampler) const;

  /// What E / pi is multiplied with: base * (1 - metallic) * (1 - transmission) * mean (1 - F). 0 for unlit and for
  /// backs of single-sided triangles.
  [[nodiscard]] glm::vec3 diffuse_albedo(const SurfacePoint& point) const;
  /// Own radiance, nits (unlit: base colour). 0 on backs of single-sided triangles.
  [[nodiscard]] glm::vec3 emission(const SurfacePoint& point) const;
  /// Coverage: 1 unless the material is BLEND.
  [[nodiscard]] float alpha(const SurfacePoint& point) const;
  /// Weight of what is straight behind in the view-independent picture.
  [[nodiscard]] glm::vec3 transparency(const SurfacePoint& point) const;

  /// One sample of the light that leaves `point` towards `eye` (recentred world space) by specular and transmission
  /// lobes. With it, all light but straight passage is emission + diffuse_factor * (view_independent - emission) +
  /// radiance: the factor is a function of the angle alone, so it is left to who draws, and costs no noise. A texel's
  /// plane may face away from an eye that sees the texel beside: the eye is then mirrored to the front. Volumes without
  /// a boundary are looked straight through. With `stored`, soft light at the first diffuse surface that it knows is
  /// taken from there (see soft_light()); sharp light is not, since a mirror would show how coarse its texels are.
  [[nodiscard]] ViewDependentLight view_dependent(const SurfacePoint& point, const glm::vec3& eye, Sampler& sampler,
                                                  const StoredLight* stored = nullptr) const;
  /// Share of what is straight behind that a clear surface passes, without Fresnel's term (which needs the eye): tint
  /// of a thin smooth surface, 0 for everything that blurs or bends.
  [[nodiscard]] glm::vec3 clear_tint(const SurfacePoint& point) const;

  /// One sample of the radiance along a camera ray, every effect included.
  [[nodiscard]] glm::vec3 full_radiance(const trace::Ray& ray, Sampler& sampler) const;

  /// The same for the view-independent picture: alpha-weighted own light of each layer, plus what lies straight behind
  /// times MaterialPoint::view_independent_transparency; sky and sun's disc where nothing is hit. Volumes are opaque.
  [[nodiscard]] glm::vec3 view_independent_radiance(const trace::Ray& ray, Sampler& sampler) const;

  [[nodiscard]] const trace::RayScene& rays() const { return *world_->rays; }
  [[nodiscard]] const LightSet& lights() const { return world_->lights; }
  [[nodiscard]] const std::shared_ptr<const scene::Scene>& scene() const { return world_->scene; }
  [[nodiscard]] const std::shared_ptr<const trace::RayScene>& share_rays() const { return world_->rays; }
  [[nodiscard]] const TransportOptions& options() const { return world_->options; }
  [[nodiscard]] const scene::EffectPlan& plan() const { return plan_; }
  /// Those whose code runs: at least what the plan calls for.
  [[nodiscard]] Effects effects() const { return integrator_->effects(); }

 private:
  std::shared_ptr<const TransportWorld> world_;
  scene::EffectPlan plan_;
  std::shared_ptr<const Integrator> integrator_;
};

}  // namespace darm::renderer
