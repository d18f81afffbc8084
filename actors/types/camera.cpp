#include "actors/types/camera.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/mat3x3.hpp>

namespace darm {
namespace {

bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// An up vector that is not parallel to `forward`.
glm::dvec3 usable_up(const glm::dvec3& forward, glm::dvec3 up) {
  if (!finite(up) || glm::length(up) < 1e-12) up = {0, 1, 0};
  up = glm::normalize(up);
  if (glm::length(glm::cross(forward, up)) < 1e-6)
    up = std::abs(forward.z) < 0.9 ? glm::dvec3{0, 0, -1} : glm::dvec3{0, 1, 0};
  return up;
}

}  // namespace

Camera look_at(glm::dvec3 position, glm::dvec3 target, double fovy_degrees, glm::dvec3 up) {
  Camera camera;
  if (!finite(position)) position = glm::dvec3(0.0);
  if (!finite(target)) target = position + glm::dvec3{0, 0, -1};
  if (!std::isfinite(fovy_degrees)) fovy_degrees = 60.0;
  camera.position = position;
  camera.fovy = static_cast<float>(std::clamp(fovy_degrees, 0.1, 179.0) * glm::pi<double>() / 180.0);
  glm::dvec3 forward = target - position;
  const double length = glm::length(forward);
  forward = std::isfinite(length) && length > 1e-12 ? forward / length : glm::dvec3{0, 0, -1};
  const glm::dvec3 right = glm::normalize(glm::cross(forward, usable_up(forward, up)));
  const glm::dvec3 true_up = glm::cross(right, forward);
  const glm::dmat3 to_world(right, true_up, -forward);
  camera.orientation = glm::normalize(glm::quat(glm::quat_cast(to_world)));
  return camera;
}

bool is_valid(const Camera& c) {
  const auto& q = c.orientation;
  if (!finite(c.position) || glm::length(c.position) > 1e9) return false;
  if (!std::isfinite(q.w) || !std::isfinite(q.x) || !std::isfinite(q.y) || !std::isfinite(q.z)) return false;
  const double norm = double(q.w) * q.w + double(q.x) * q.x + double(q.y) * q.y + double(q.z) * q.z;
  return std::abs(norm - 1.0) < 1e-2 && std::isfinite(c.fovy) && c.fovy > 1e-3f && c.fovy < 3.14f;
}

bool is_valid(const Viewport& v) { return v.width >= 1 && v.height >= 1 && v.width <= 16384 && v.height <= 16384; }

glm::vec3 ray_direction(const Camera& camera, const Viewport& viewport, float x, float y) {
  const float half_height = std::tan(camera.fovy * 0.5f);
  const auto width = static_cast<float>(viewport.width);
  const auto height = static_cast<float>(viewport.height);
  const glm::vec3 local((2.0f * x - width) / height * half_height, (1.0f - 2.0f * y / height) * half_height, -1.0f);
  return glm::normalize(camera.orientation * local);
}

float pixel_spread(const Camera& camera, const Viewport& viewport) {
  return 2.0f * std::tan(camera.fovy * 0.5f) / static_cast<float>(viewport.height);
}

}  // namespace darm
