// How the camera moves: walking and orbiting, at speeds that suit a scene of 7 mm and one of 3 km. Pure; the same as
// the web client's (client/web/src/page/rig.ts), so that a hand that knows one knows the other.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

#include "client/desktop/upright_view.hpp"

namespace darm::client::desktop {

/// Metres a second in a scene whose box has this diagonal: a person's pace (1.6 m/s) at 20 m; below, the same share of
/// the scene; above, growing with its square root, so that 3 km are crossed in minutes.
[[nodiscard]] double walk_speed(double diagonal);

/// Of the scene, file coordinates.
struct Bounds {
  glm::dvec3 low{-1.0}, high{1.0};
};

enum class Mode : std::uint8_t { kWalk, kOrbit };

class Rig {
 public:
  Mode mode = Mode::kWalk;
  glm::dvec3 pivot{0.0};  ///< what an orbit turns around, file coordinates
  UprightView view;

  Rig(const UprightView& start, const Bounds& bounds) : view(start) { set_bounds(bounds); }

  /// An eye outside of them looks at an object, one inside walks through rooms. The pivot becomes their centre.
  void set_bounds(const Bounds& bounds);
  [[nodiscard]] double diagonal() const;
  /// It still moves by itself.
  [[nodiscard]] bool moving() const;

  /// Turns the head, radians.
  void look(double yaw, double pitch);
  /// Turns around the pivot, radians; the pivot keeps its place on the screen.
  void orbit(double yaw, double pitch);
  /// Towards the pivot (steps > 0) or away: each step an eighth of the distance, never past it.
  void dolly(double steps);
  /// Eye and pivot move across the screen, in shares of its height: what is at the pivot follows the hand.
  void pan(double x, double y);
  /// One step of a wheel ahead: a fifth of a second's way.
  void stride(double steps);
  /// Walks for `seconds`: `wish` is right, up, ahead, each in [-1, 1]; ahead is level, so that looking down does not
  /// sink. The speed eases in and out.
  void walk(const glm::dvec3& wish, bool hurry, double seconds);
  void stop() { velocity_ = glm::dvec3(0.0); }

 private:
  Bounds bounds_;
  glm::dvec3 velocity_{0.0};
};

}  // namespace darm::client::desktop
