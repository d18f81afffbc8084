#include "client/desktop/rig.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace darm::client::desktop {
namespace {

constexpr double kHurry = 4;
constexpr double kEase = 0.09;  // seconds after which speed has come two thirds of the way to what is asked for

}  // namespace

double walk_speed(double diagonal) { return diagonal < 20 ? 0.08 * diagonal : 1.6 * std::sqrt(diagonal / 20); }

void Rig::set_bounds(const Bounds& bounds) {
  bounds_ = bounds;
  bool inside = true;
  for (int i = 0; i < 3; ++i)
    inside = inside && view.position[i] >= bounds.low[i] && view.position[i] <= bounds.high[i];
  mode = inside ? Mode::kWalk : Mode::kOrbit;
  pivot = (bounds.low + bounds.high) * 0.5;
}

double Rig::diagonal() const { return std::max(1e-6, glm::length(bounds_.high - bounds_.low)); }

bool Rig::moving() const { return glm::length(velocity_) > 0.005 * walk_speed(diagonal()); }

void Rig::look(double yaw, double pitch) {
  view.yaw += yaw;
  view.pitch += pitch;
  view = tidy(view);
}

void Rig::orbit(double yaw, double pitch) {
  UprightView after = view;
  after.yaw += yaw;
  after.pitch += pitch;
  after = tidy(after);
  const glm::dvec3 arm = pivot - view.position;
  const glm::dvec3 offset = right(after) * glm::dot(arm, right(view)) + up(after) * glm::dot(arm, up(view)) +
                            forward(after) * glm::dot(arm, forward(view));
  after.position = pivot - offset;
  view = after;
}

void Rig::dolly(double steps) {
  const glm::dvec3 arm = pivot - view.position;
  const double distance = glm::length(arm), nearest = diagonal() * 1e-4;
  if (distance < nearest * 0.5) return;
  const double wanted = std::clamp(distance * std::pow(0.875, steps), nearest, diagonal() * 20);
  view.position += arm * (1 - wanted / distance);
}

void Rig::pan(double x, double y) {
  const double depth = std::max(diagonal() * 1e-3, glm::dot(pivot - view.position, forward(view)));
  const double height = 2 * depth * std::tan(view.fovy / 2);
  const glm::dvec3 by = right(view) * (-x * height) + up(view) * (y * height);
  view.position += by;
  pivot += by;
}

void Rig::stride(double steps) { view.position += forward(view) * (steps * 0.2 * walk_speed(diagonal())); }

void Rig::walk(const glm::dvec3& wish, bool hurry, double seconds) {
  const double speed = walk_speed(diagonal()) * (hurry ? kHurry : 1) / std::max(1.0, glm::length(wish));
  const glm::dvec3 level(-std::sin(view.yaw), 0.0, -std::cos(view.yaw));
  const glm::dvec3 target = (right(view) * wish.x + glm::dvec3(0, wish.y, 0) + level * wish.z) * speed;
  velocity_ = glm::mix(target, velocity_, std::exp(-seconds / kEase));
  if (!moving()) stop();
  const glm::dvec3 by = velocity_ * seconds;
  view.position += by;
  if (mode == Mode::kOrbit) pivot += by;
}

}  // namespace darm::client::desktop
