// Where the client looks from, and the matrices that follow from it.
#pragma once

#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "proto/darm.pb.h"

namespace darm::client {

/// Pinhole view. Looks along -Z of `orientation` (camera to world, unit), +Y up; file coordinates, metres.
struct View {
  glm::dvec3 position{0.0};
  glm::dquat orientation{1, 0, 0, 0};
  double fovy = 0.8;  ///< vertical field of view, radians, in (0, pi)
  std::uint32_t width = 1280;
  std::uint32_t height = 720;
};

/// View from `position` towards `target`, world +Y up (another axis where that is parallel). Finite input always gives
/// a valid view; target == position looks along -Z, fovy is clamped to [0.1, 179] degrees.
[[nodiscard]] View look_at(const glm::dvec3& position, const glm::dvec3& target, double fovy_degrees,
                           std::uint32_t width, std::uint32_t height);

/// The view as it travels to the server, and back. A pose from the wire that is not a valid view gives false.
[[nodiscard]] wire::Pose to_pose(const View& view);
[[nodiscard]] bool from_pose(const wire::Pose& pose, View& view);

/// World (with `origin` subtracted) to camera space, in double: large coordinates keep their precision.
[[nodiscard]] glm::dmat4 view_matrix(const View& view, const glm::dvec3& origin);

/// Camera space to clip space. `reversed_zero_to_one`: near is depth 1, infinity 0 (GL_EXT_clip_control);
/// otherwise the GL convention between `near_plane` and `far_plane`. 0 < near_plane < far_plane.
[[nodiscard]] glm::dmat4 projection_matrix(const View& view, double near_plane, double far_plane,
                                           bool reversed_zero_to_one);

}  // namespace darm::client
