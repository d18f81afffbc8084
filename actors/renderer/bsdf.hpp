// Scattering at a surface point: glTF 2.0 appendix B with transmission, volume and ior.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

#include "actors/renderer/material_point.hpp"
#include "actors/renderer/sampler.hpp"
#include "actors/renderer/trace/surface.hpp"

namespace darm::renderer {

/// A sampled direction: `weight` = f |cos| / pdf of all lobes together. pdf 0: absorbed.
struct BsdfSample {
  glm::vec3 direction{0.0f};
  glm::vec3 weight{0.0f};
  float pdf = 0;
};

/// Which lobes a Bsdf has: all, or all but the diffuse one.
enum class Lobes : std::uint8_t { kAll, kSpecular };

/// A template over what the scene's materials call for: without `kSpecular` neither metal nor any dielectric with an
/// index other than 1 may come, without `kTransmits` no transmission. What is left out gives the same numbers, bit by
/// bit, and draws as many.
/// Lobes: Lambert, weighted by 1 - F(n.v), under a Schlick-weighted GGX coat (VNDF sampled, height-correlated Smith),
/// metal GGX, and transmission: thin walls scatter to the mirrored side, volumes refract (Walter et al., Microfacet
/// Models for Refraction, 2007). Straight passage (MaterialPoint::straight_through) is not a lobe: the path walks
/// through before it gets here. Directions point away from the surface; unit length.
template <bool kSpecular, bool kTransmits>
class BasicBsdf {
 public:
  /// `wo`: towards where the path came from, on the side of surface.geometric_normal.
  BasicBsdf(const trace::Surface& surface, const MaterialPoint& material, const glm::vec3& wo,
            Lobes lobes = Lobes::kAll);

  /// f(wo, wi) |cos wi| and the density with which sample() gives wi.
  [[nodiscard]] glm::vec3 evaluate(const glm::vec3& wi, float& pdf) const;
  [[nodiscard]] BsdfSample sample(Sampler& sampler) const;
  /// False: light reaches only from the front of the geometric normal.
  [[nodiscard]] bool transmits() const { return kTransmits && transmit_probability_ > 0; }
  [[nodiscard]] const glm::vec3& normal() const { return normal_; }
  [[nodiscard]] const glm::vec3& geometric_normal() const { return geometric_; }

 private:
  [[nodiscard]] glm::vec3 to_local(const glm::vec3& w) const;
  [[nodiscard]] glm::vec3 to_world(const glm::vec3& w) const;
  [[nodiscard]] float fresnel(float cosine) const;
  [[nodiscard]] glm::vec3 diffuse_share() const;
  [[nodiscard]] glm::vec3 reflectance(float cosine) const;
  [[nodiscard]] glm::vec3 evaluate_reflection(const glm::vec3& wi, const glm::vec3& li, float& pdf) const;
  [[nodiscard]] glm::vec3 evaluate_thin(const glm::vec3& li, float& pdf) const;
  [[nodiscard]] glm::vec3 evaluate_refraction(const glm::vec3& li, float& pdf) const;
  [[nodiscard]] glm::vec3 sample_refraction(const glm::vec2& xi) const;
  [[nodiscard]] glm::vec3 sample_transmission(const glm::vec2& xi) const;

  MaterialPoint material_;
  glm::vec3 normal_;  // diffuse lobe
  glm::vec3 geometric_;
  glm::vec3 axis_[3];            // frame of the specular lobes
  glm::vec3 wo_{0.0f, 0, 1.0f};  // in that frame, z > 0
  float eta_ = 1;                // index on wo's side over index beyond, for volumes
  float diffuse_probability_ = 0;
  float specular_probability_ = 0;
  float transmit_probability_ = 0;
};

using Bsdf = BasicBsdf<true, true>;

extern template class BasicBsdf<false, false>;
extern template class BasicBsdf<true, false>;
extern template class BasicBsdf<true, true>;

}  // namespace darm::renderer
