#include "client/desktop/steering.hpp"

#include <algorithm>
#include <cmath>

namespace darm::client::desktop {
namespace {

constexpr double kTurnSpeed = 1.2;       // radians a second, by key
constexpr double kStickTurnSpeed = 2.2;  // radians a second, stick fully over
constexpr double kDeadZone = 0.15;
constexpr double kStridesAcross = 20;                      // of a drag across the window
constexpr double kMostSteps = 5;                           // of one turn of the wheel
constexpr double kFirstStep = 0.016, kLongestStep = 0.25;  // seconds

}  // namespace

double axis_of(double value) {
  const double beyond = (std::abs(value) - kDeadZone) / (1 - kDeadZone);
  if (!(beyond > 0)) return 0;
  return std::copysign(std::min(1.0, beyond), value);
}

void add(Steering& s, const HeldKeys& k) {
  s.wish += glm::dvec3(k.right - k.left, k.up - k.down, k.ahead - k.back);
  s.yaw += (k.turn_left - k.turn_right) * kTurnSpeed;
  s.pitch += (k.look_up - k.look_down) * kTurnSpeed;
  s.hurry = s.hurry || k.hurry;
}

void add(Steering& s, const Sticks& pad) {
  s.wish += glm::dvec3(axis_of(pad.left[0]), pad.right_trigger - pad.left_trigger, -axis_of(pad.left[1]));
  s.yaw -= axis_of(pad.right[0]) * kStickTurnSpeed;
  s.pitch -= axis_of(pad.right[1]) * kStickTurnSpeed;
  s.hurry = s.hurry || pad.hurry;
}

double step_seconds(double since_ms, bool rested) {
  return rested ? kFirstStep : std::clamp(since_ms / 1000, 0.0, kLongestStep);
}

bool steer(Rig& rig, const Steering& steering, double seconds) {
  if (!steering.any() && !rig.moving()) return false;
  const double yaw = steering.yaw * seconds, pitch = steering.pitch * seconds;
  if (rig.mode == Mode::kOrbit) {
    rig.orbit(yaw, pitch);
  } else {
    rig.look(yaw, pitch);
  }
  rig.walk(steering.wish, steering.hurry, seconds);
  return true;
}

void drag(Rig& rig, double dx, double dy, bool second) {
  if (rig.mode == Mode::kOrbit) {
    if (second) {
      rig.pan(dx, dy);
    } else {
      rig.orbit(-dx * kPi, -dy * kPi);
    }
  } else if (second) {
    rig.stride(-dy * kStridesAcross);
  } else {
    rig.look(dx * rig.view.fovy, dy * rig.view.fovy);
  }
}

void roll(Rig& rig, double steps) {
  const double held = std::clamp(steps, -kMostSteps, kMostSteps);
  if (rig.mode == Mode::kOrbit) {
    rig.dolly(held);
  } else {
    rig.stride(held);
  }
}

}  // namespace darm::client::desktop
