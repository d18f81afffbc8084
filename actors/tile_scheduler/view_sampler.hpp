// One picture sample -> the surfaces it shows, each with its patch position, footprint and sharp level.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>

#include "actors/atlas/layout.hpp"
#include "actors/renderer/trace/ray_scene.hpp"
#include "actors/scene/scene.hpp"
#include "actors/types/camera.hpp"

namespace darm::tile_scheduler {

/// Surfaces one sample may show: what is BLEND or transmissive is seen together with what lies behind it.
inline constexpr int kMaxLayers = 4;
/// A grazing footprint is taken to be at most this many times longer than wide.
inline constexpr float kMaxAnisotropy = 64.0f;

/// A surface seen by a sample.
struct SurfaceSample {
  PatchId patch = kNoPatch;
  std::uint32_t instance = 0;
  int level = 0;           ///< sharp level
  float cosine = 1;        ///< between the triangle's normal and the eye, 0..1
  float pixel_texels = 0;  ///< minor axis of a pixel's footprint, texels of level 0: under 1, a pixel wants finer ones
  glm::vec2 uv{0.0f};      ///< position in the patch, world units
  glm::vec2 patch_size{0.0f};  ///< extent of the patch, world units
  glm::vec2 uv_dx{0.0f};       ///< change of uv per pixel to the right
  glm::vec2 uv_dy{0.0f};       ///< change of uv per pixel down
};

/// Minor and major axis of the footprint of one pixel: singular values of J = [d(uv)/dx, d(uv)/dy], world units of the
/// patch. The major axis is at most kMaxAnisotropy * minor. Not finite or not positive: both 0.
struct Footprint {
  float minor = 0;
  float major = 0;
};
[[nodiscard]] Footprint footprint_of(glm::vec2 uv_dx, glm::vec2 uv_dy);

/// The sharp level of a pixel, the same on server and client: with J = [d(uv * q)/dx, d(uv * q)/dy] per *pixel* of the
/// final picture (not per sample of it) and `minor` its smaller singular value,
///   level = clamp(floor(log2(max(minor, 1e-6))), 0, coarse_level).
/// In GLSL, with a = dFdx(uv) * q, b = dFdy(uv) * q, p = dot(a, a) + dot(b, b), d = a.x * b.y - a.y * b.x:
///   minor = sqrt(max(0, 0.5 * (p - sqrt(max(0, p * p - 4 * d * d)))))   (better conditioned: |d| / major).
[[nodiscard]] int sharp_level(float minor_texels, int coarse_level);

/// Traces single samples of one view. Cheap to make; const and thread-safe. `layout` (of rays.scene()) and `rays` must
/// outlive it.
class ViewSampler {
 public:
  ViewSampler(const atlas::Layout& layout, const renderer::trace::RayScene& rays, const Camera& camera,
              const Viewport& viewport);

  /// Surfaces at picture position (x, y), pixels from the top left, nearest first. Returns how many (0: nothing there).
  [[nodiscard]] int trace(float x, float y, std::array<SurfaceSample, kMaxLayers>& out) const;
  [[nodiscard]] const atlas::Layout& layout() const { return layout_; }
  [[nodiscard]] const Viewport& viewport() const { return viewport_; }

 private:
  [[nodiscard]] bool surface_of(const renderer::trace::Hit& hit, const glm::vec3& direction, SurfaceSample& out) const;

  const atlas::Layout& layout_;
  const renderer::trace::RayScene& rays_;
  Viewport viewport_;
  glm::vec3 origin_;
  glm::vec3 corner_;  // direction through picture position (0, 0); not unit: linear in x and y
  glm::vec3 right_;   // its change per pixel to the right
  glm::vec3 down_;    // and down
  float past_;        // a distance that rounding of a surface's position does not reach
};

}  // namespace darm::tile_scheduler
