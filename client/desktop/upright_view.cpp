#include "client/desktop/upright_view.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

namespace darm::client::desktop {
namespace {

double finite(double value) { return std::isfinite(value) ? value : 0.0; }

}  // namespace

UprightView tidy(UprightView view) {
  view.position = {finite(view.position.x), finite(view.position.y), finite(view.position.z)};
  view.yaw = finite(view.yaw);
  view.yaw -= 2 * kPi * std::round(view.yaw / (2 * kPi));
  view.pitch = std::clamp(finite(view.pitch), -kSteepest, kSteepest);
  view.fovy = std::clamp(std::isfinite(view.fovy) ? view.fovy : 50 * kDegree, kNarrowest, kWidest);
  return view;
}

glm::dvec3 forward(const UprightView& view) {
  const double flat = std::cos(view.pitch);
  return {-std::sin(view.yaw) * flat, std::sin(view.pitch), -std::cos(view.yaw) * flat};
}

glm::dvec3 right(const UprightView& view) { return {std::cos(view.yaw), 0.0, -std::sin(view.yaw)}; }

glm::dvec3 up(const UprightView& view) { return glm::cross(right(view), forward(view)); }

UprightView view_along(const glm::dvec3& position, const glm::dvec3& direction, double fovy) {
  const double flat = std::hypot(direction.x, direction.z);
  UprightView view;
  view.position = position;
  view.yaw = flat > 1e-12 ? std::atan2(-direction.x, -direction.z) : 0.0;
  view.pitch = std::atan2(direction.y, flat);
  view.fovy = fovy;
  return tidy(view);
}

UprightView upright(const View& view) {
  return view_along(view.position, view.orientation * glm::dvec3(0, 0, -1), view.fovy);
}

View to_view(const UprightView& view, std::uint32_t width, std::uint32_t height) {
  View out;
  out.position = view.position;
  out.orientation = glm::angleAxis(view.yaw, glm::dvec3(0, 1, 0)) * glm::angleAxis(view.pitch, glm::dvec3(1, 0, 0));
  out.fovy = view.fovy;
  out.width = width;
  out.height = height;
  return out;
}

}  // namespace darm::client::desktop
