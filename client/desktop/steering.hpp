// Keys and sticks that are held, turned into what the rig understands. Pure; as client/web/src/page/input.ts.
#pragma once

#include <array>
#include <glm/vec3.hpp>

#include "client/desktop/rig.hpp"

namespace darm::client::desktop {

/// What is held down now.
struct HeldKeys {
  bool ahead = false, back = false, left = false, right = false, up = false, down = false;
  bool turn_left = false, turn_right = false, look_up = false, look_down = false, hurry = false;
};

/// A gamepad in the usual layout.
struct Sticks {
  std::array<double, 2> left{}, right{};       ///< x to the right, y down, in [-1, 1]
  double left_trigger = 0, right_trigger = 0;  ///< 0 (free) .. 1
  bool hurry = false;                          ///< left stick pressed, or right bumper
};

/// Speeds asked for.
struct Steering {
  glm::dvec3 wish{0.0};  ///< right, up, ahead
  double yaw = 0;        ///< radians a second
  double pitch = 0;
  bool hurry = false;
  [[nodiscard]] bool any() const { return wish != glm::dvec3(0.0) || yaw != 0 || pitch != 0; }
};

/// A stick's axis without its centre's wobble, in [-1, 1]. NaN is 0.
[[nodiscard]] double axis_of(double value);
void add(Steering& steering, const HeldKeys& keys);
void add(Steering& steering, const Sticks& pad);

/// Seconds that a hand moves the view in one step of the loop, `since_ms` after the last. Having `rested`, the time
/// since then says nothing, and the step is a short one, not a leap; a slow device walks no slower than a quick one.
[[nodiscard]] double step_seconds(double since_ms, bool rested);

/// Moves the rig for `seconds`; true while something moves it.
bool steer(Rig& rig, const Steering& steering, double seconds);

/// The mouse is dragged by shares of the window's height. `second`: another button, or with Shift. Across the whole
/// height turns by the field of view when walking (the scene sticks to the hand), by half a turn when orbiting.
void drag(Rig& rig, double dx, double dy, bool second);
/// Wheel, steps ahead.
void roll(Rig& rig, double steps);

}  // namespace darm::client::desktop
