// Where the visitor looks from: an upright camera. Pure; the same as the web client's (client/web/src/page/camera.ts).
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

#include "client/core/view.hpp"

namespace darm::client::desktop {

/// File coordinates in metres, angles in radians. Yaw 0 looks along -Z, positive turns left.
struct UprightView {
  glm::dvec3 position{0.0};
  double yaw = 0;
  double pitch = 0;  ///< in [-kSteepest, kSteepest], positive looks up
  double fovy = 50.0 * 3.14159265358979323846 / 180.0;
};

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kDegree = kPi / 180.0;
inline constexpr double kSteepest = kPi / 2 - 1e-3;
inline constexpr double kNarrowest = 1.0 * kDegree;
inline constexpr double kWidest = 150.0 * kDegree;

/// Any input gives a view that can be drawn: angles are wrapped and held, what is not finite becomes 0 (fovy 50
/// degrees).
[[nodiscard]] UprightView tidy(UprightView view);

[[nodiscard]] glm::dvec3 forward(const UprightView& view);
[[nodiscard]] glm::dvec3 right(const UprightView& view);
[[nodiscard]] glm::dvec3 up(const UprightView& view);

/// The upright view that looks along `direction`, which need not be unit.
[[nodiscard]] UprightView view_along(const glm::dvec3& position, const glm::dvec3& direction, double fovy);
/// A camera's roll is given up.
[[nodiscard]] UprightView upright(const View& view);
[[nodiscard]] View to_view(const UprightView& view, std::uint32_t width, std::uint32_t height);

}  // namespace darm::client::desktop
