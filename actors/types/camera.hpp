// A camera pose as it travels between rooms, in scene units (recentred: see scene::Scene::origin).
#pragma once

#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

namespace darm {

/// Pinhole camera. Looks along -Z of `orientation`, +Y is up, +X is right (glTF's convention).
/// Valid: finite position, unit quaternion, fovy in (0, pi). Make one with `make_camera` or check with `is_valid`.
struct Camera {
  glm::dvec3 position{0.0};           ///< file coordinates (metres), before recentring
  glm::quat orientation{1, 0, 0, 0};  ///< camera to world, unit length
  float fovy = 0.8f;                  ///< vertical field of view, radians
};

/// Size of the picture the camera is drawn at, pixels. Valid: 1..16384 each.
struct Viewport {
  std::uint32_t width = 1280;
  std::uint32_t height = 720;
};

/// A camera at `position` that looks at `target`. Any finite input gives a valid camera: a zero or parallel up vector
/// is replaced, target == position looks along -Z, fovy is clamped to [0.1, 179] degrees, NaN falls back to defaults.
[[nodiscard]] Camera look_at(glm::dvec3 position, glm::dvec3 target, double fovy_degrees, glm::dvec3 up = {0, 1, 0});

/// True if every number is finite and in range; what comes from the network passes here first.
[[nodiscard]] bool is_valid(const Camera& camera);
[[nodiscard]] bool is_valid(const Viewport& viewport);

/// World direction (unit) of the ray through picture position (x, y) in pixels, origin top left.
[[nodiscard]] glm::vec3 ray_direction(const Camera& camera, const Viewport& viewport, float x, float y);

/// Angle subtended by one pixel at the picture's centre, radians: 2 tan(fovy / 2) / height.
[[nodiscard]] float pixel_spread(const Camera& camera, const Viewport& viewport);

}  // namespace darm
