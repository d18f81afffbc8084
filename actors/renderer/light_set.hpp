// Everything in a scene that shines, arranged for drawing one light at a time.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "actors/renderer/sampling.hpp"
#include "actors/renderer/trace/ray_scene.hpp"
#include "actors/scene/scene.hpp"

namespace darm::renderer {

/// A directional light; a disc of angular diameter > 0 or a delta light.
struct SunLight {
  glm::vec3 towards{0, 1, 0};  ///< unit vector to the light
  glm::vec3 tangent{1, 0, 0}, bitangent{0, 0, 1};
  glm::vec3 irradiance{0.0f};  ///< at normal incidence
  glm::vec3 radiance{0.0f};    ///< of the disc: irradiance / (pi sin^2 of its radius); 0 for a delta light
  float chord2 = 0;            ///< squared distance from `towards` to the disc's rim on the unit sphere; 0: delta
  [[nodiscard]] bool is_disc() const { return chord2 > 0; }
  /// Density of sampling the disc uniformly, per steradian.
  [[nodiscard]] float pdf() const { return 1.0f / (kPi * chord2); }
  [[nodiscard]] bool covers(const glm::vec3& direction) const {
    const glm::vec3 d = direction - towards;
    return glm::dot(d, d) < chord2;
  }
};

/// Light from a point light as it arrives, unshadowed: irradiance at normal incidence over the probability of the draw.
struct PunctualDraw {
  glm::vec3 position{0.0f};
  glm::vec3 irradiance{0.0f};  ///< 0: nothing arrives
};

/// A point drawn on an emissive triangle.
struct EmitterDraw {
  glm::vec3 position{0.0f};
  glm::vec3 normal{0, 0, 1};  ///< of the triangle's front
  glm::vec3 radiance{0.0f};
  float pdf_area = 0;  ///< per m2; 0: nothing drawn
  bool double_sided = false;
};

/// Immutable after construction; thread-safe.
class LightSet {
 public:
  explicit LightSet(const trace::RayScene& rays);

  [[nodiscard]] const std::vector<SunLight>& suns() const { return suns_; }
  [[nodiscard]] bool has_punctual() const { return !punctual_.empty(); }
  [[nodiscard]] bool has_emitters() const { return !emitters_.empty(); }

  /// Point and spot lights for a receiver at `position`: out.size() (>= 1) picks, each with a probability proportional
  /// to a light's unshadowed irradiance there (all lights are looked at up to kAllLights; beyond, one pick by
  /// intensity), spread evenly from `xi` in [0, 1). The irradiances sum to an unbiased estimate of what arrives
  /// unshadowed. `normal`: cosine to weight with. `both_sides`: the receiver also takes light from behind. Every light
  /// that can contribute has a probability > 0. Returns how many different lights were picked.
  std::size_t draw_punctual(const glm::vec3& position, const glm::vec3& normal, bool both_sides, float xi,
                            std::span<PunctualDraw> out) const;
  static constexpr std::size_t kAllLights = 256;

  /// A point on an emissive triangle, triangles drawn by power.
  [[nodiscard]] EmitterDraw draw_emitter(float xi, const glm::vec2& point) const;
  /// Density per m2 with which draw_emitter gives a point of this triangle; 0 if it never does.
  [[nodiscard]] float emitter_pdf(std::uint32_t instance, std::uint32_t triangle) const;

 private:
  /// Fills in the weights of the first lights; returns their sum.
  float weigh_punctual(const glm::vec3& position, const glm::vec3& normal, bool both_sides,
                       std::span<float> weight) const;
  struct Punctual {
    glm::vec3 position{0.0f};
    glm::vec3 intensity{0.0f};
    glm::vec3 direction{0, 0, -1};
    float inverse_range2 = 0;  // 1 / range^2; 0: infinite
    float spot_scale = 0;      // attenuation = clamp(cos * scale + offset)^2
    float spot_offset = 1;
  };
  struct Emitter {
    std::uint32_t instance, triangle;
    float inverse_area;
  };

  void add_emitters(const trace::RayScene& rays, std::uint32_t instance, std::vector<double>& power);
  [[nodiscard]] glm::vec3 arriving(const Punctual& light, const glm::vec3& position) const;

  const trace::RayScene& rays_;
  float nearest_square_ = 0;  // squared distance below which a point light shines no brighter
  std::vector<SunLight> suns_;
  std::vector<Punctual> punctual_;
  std::vector<float> punctual_x_, punctual_y_, punctual_z_, punctual_power_;  // for the loop over all lights
  AliasTable punctual_table_;
  std::vector<Emitter> emitters_;
  AliasTable emitter_table_;
  std::vector<std::vector<float>> emitter_pdf_;  // per instance: empty or one per triangle
};

}  // namespace darm::renderer
