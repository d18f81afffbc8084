// Ray queries on a scene. The one place that knows the ray library (Embree 3).
#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "actors/scene/scene.hpp"
#include "actors/scene/texture_sampling.hpp"
#include "actors/types/error.hpp"

namespace darm::renderer::trace {

/// Points origin + t * direction, tmin <= t <= tmax, in recentred world space. `direction` need not be unit length;
/// t counts in its lengths. A ray with NaN, an infinite origin or a zero direction hits nothing and is not occluded.
struct Ray {
  glm::vec3 origin{0.0f};
  float tmin = 0.0f;
  glm::vec3 direction{0, 0, -1};
  float tmax = 1e30f;
};

/// Nearest surface: point (1 - u - v, u, v) of a triangle of an instance; `front`: the ray came from the side of which
/// scene::Instance speaks.
struct Hit {
  float t = 0;
  std::uint32_t instance = 0;
  std::uint32_t triangle = 0;
  float u = 0;
  float v = 0;
  bool front = true;
};

/// An instance as the ray library sees it: vertices in world space, in the order of Mesh::positions.
struct WorldInstance {
  const scene::Mesh* mesh = nullptr;
  const scene::Material* material = nullptr;
  const glm::vec3* positions = nullptr;
  glm::mat3 normal_to_world{1.0f};   ///< inverse transpose of the upper 3x3
  glm::mat3 tangent_to_world{1.0f};  ///< upper 3x3
  float handedness = 1.0f;           ///< -1 where the instance mirrors
  scene::TextureSet textures;        ///< of the material
};

/// Immutable after build; every query is thread-safe and allocates nothing.
class RayScene {
 public:
  /// On which geometry the ray library calls back for each hit: where alpha MASK asks for it, or everywhere, as an
  /// integrator would need that knew nothing of the scene (for comparison; rays find the same).
  enum class Filters : std::uint8_t { kWhereMasked, kEverywhere };
  /// Builds the acceleration structure with `threads` threads (at least 1). An empty scene is fine: nothing is hit.
  /// Errors: an instance or triangle that points outside its arrays; out of memory.
  [[nodiscard]] static Result<std::shared_ptr<const RayScene>> build(std::shared_ptr<const scene::Scene> scene,
                                                                     unsigned threads,
                                                                     Filters filters = Filters::kWhereMasked);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// Nearest hit. Alpha MASK below its cutoff is passed through; BLEND counts as solid here.
  [[nodiscard]] bool closest(const Ray& ray, Hit& hit) const;
  /// The same, and the backs of single-sided triangles are passed through: a camera looks through them.
  [[nodiscard]] bool closest_camera(const Ray& ray, Hit& hit) const;
  /// True if anything solid (MASK honoured, BLEND and clear surfaces solid) lies within [tmin, tmax].
  [[nodiscard]] bool occluded(const Ray& ray) const;

  [[nodiscard]] const scene::Scene& scene() const { return *scene_; }
  [[nodiscard]] const WorldInstance& instance(std::uint32_t index) const { return instances_[index]; }
  [[nodiscard]] std::uint32_t instance_count() const { return static_cast<std::uint32_t>(instances_.size()); }
  [[nodiscard]] bool has_masks() const { return has_masks_; }

 private:
  struct Device;
  RayScene() = default;

  std::shared_ptr<const scene::Scene> scene_;
  std::vector<std::vector<glm::vec3>> world_positions_;  // one per instance, padded by one vertex for 16-byte loads
  std::vector<WorldInstance> instances_;
  bool has_masks_ = false;
  std::unique_ptr<Device> device_;
};

/// Sets flush-to-zero and denormals-are-zero for the calling thread while it lives (the ray library asks for it, and
/// results must not depend on which thread computes them), then restores what was.
class DenormalsAreZero {
 public:
  DenormalsAreZero();
  ~DenormalsAreZero();
  DenormalsAreZero(const DenormalsAreZero&) = delete;
  DenormalsAreZero& operator=(const DenormalsAreZero&) = delete;

 private:
  unsigned saved_ = 0;
};

}  // namespace darm::renderer::trace
