// What an integrator of light answers, and the choice of the one whose code holds what a scene calls for and no more.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>

#include "actors/renderer/effects.hpp"
#include "actors/renderer/light_set.hpp"
#include "actors/renderer/sampler.hpp"
#include "actors/renderer/stored_light.hpp"
#include "actors/renderer/trace/ray_scene.hpp"
#include "actors/scene/scene.hpp"
#include "actors/types/surface_point.hpp"

namespace darm::renderer {

/// Radiance in nits. `sharp`: own emission, suns and point lights, each behind one shadow ray. `soft`: sky, emissive
/// surfaces, interreflection. Finite, >= 0.
struct ViewIndependentLight {
  glm::vec3 sharp{0.0f};
  glm::vec3 soft{0.0f};
  [[nodiscard]] glm::vec3 sum() const { return sharp + soft; }
};

/// One sample of what leaves a point for one eye alone, and how fast it changes with the eye.
struct ViewDependentLight {
  glm::vec3 radiance{0.0f};  ///< nits; finite, >= 0
  float diffuse_factor = 1;  ///< what the diffuse part of view_independent() is multiplied with for this eye
  float ggx_alpha = 1;       ///< of the lobes
  float distance = 0;        ///< to the eye, metres
  /// Luminance, nits, of what leaves the point whatever the eye, as far as stored light knows it: what the radiance is
  /// seen on top of.
  float beneath = 0;
};

/// Switches of the estimator. None changes the expectation, except for a `max_bounces` that cuts paths short.
struct TransportOptions {
  std::uint32_t max_bounces = 128;  ///< scatterings after the first vertex: of a closed room of albedo .95 all but .2 %
  std::uint32_t roulette_after = 1;  ///< paths may end by chance from this bounce on
  /// For tests of multiple importance sampling: take emissive surfaces by one strategy only.
  enum class Emitters : std::uint8_t { kBoth, kByLight, kByDirection };
  Emitters emitters = Emitters::kBoth;
  /// The integrator that holds every effect, whatever the scene calls for. The same light, bit by bit; for comparison.
  bool all_effects = false;
};

/// What an integrator works on. Immutable once made; thread-safe.
struct TransportWorld {
  std::shared_ptr<const scene::Scene> scene;
  std::shared_ptr<const trace::RayScene> rays;
  TransportOptions options;
  LightSet lights;
};

/// The questions of LightTransport, which documents them.
class Integrator {
 public:
  virtual ~Integrator() = default;
  /// Those that are compiled in.
  [[nodiscard]] virtual Effects effects() const = 0;
  [[nodiscard]] virtual ViewIndependentLight view_independent(const SurfacePoint& point, Sampler& sampler) const = 0;
  [[nodiscard]] virtual glm::vec3 sharp_light(const SurfacePoint& point, Sampler& sampler) const = 0;
  [[nodiscard]] virtual glm::vec3 soft_light(const SurfacePoint& point, Sampler& sampler,
                                             const StoredLight* stored) const = 0;
  [[nodiscard]] virtual ViewIndependentLight irradiance(const SurfacePoint& point, Sampler& sampler) const = 0;
  [[nodiscard]] virtual glm::vec3 diffuse_albedo(const SurfacePoint& point) const = 0;
  [[nodiscard]] virtual ViewDependentLight view_dependent(const SurfacePoint& point, const glm::vec3& eye,
                                                          Sampler& sampler, const StoredLight* stored) const = 0;
  [[nodiscard]] virtual glm::vec3 full_radiance(const trace::Ray& ray, Sampler& sampler) const = 0;
  [[nodiscard]] virtual glm::vec3 view_independent_radiance(const trace::Ray& ray, Sampler& sampler) const = 0;
};

/// One compiled integrator and how it is made.
struct CompiledIntegrator {
  Effects effects;
  std::shared_ptr<const Integrator> (*make)(std::shared_ptr<const TransportWorld> world);
};

/// Two translation units hold them, so that they compile side by side.
[[nodiscard]] std::span<const CompiledIntegrator> plain_integrators();     // untextured surfaces
[[nodiscard]] std::span<const CompiledIntegrator> textured_integrators();  // the last one has every effect

/// The smallest integrator that covers `needed`. A set stands before those that hold more than it does, so the first
/// that covers is one.
[[nodiscard]] const CompiledIntegrator& smallest_cover(const Effects& needed);

}  // namespace darm::renderer
