#include "client/core/view.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/mat3x3.hpp>

namespace darm::client {
namespace {

constexpr std::uint32_t kMaxSide = 16384;

bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

View look_at(const glm::dvec3& position, const glm::dvec3& target, double fovy_degrees, std::uint32_t width,
             std::uint32_t height) {
  View view;
  view.width = std::clamp(width, 1u, kMaxSide);
  view.height = std::clamp(height, 1u, kMaxSide);
  view.position = finite(position) ? position : glm::dvec3(0.0);
  view.fovy = std::clamp(std::isfinite(fovy_degrees) ? fovy_degrees : 60.0, 0.1, 179.0) * glm::pi<double>() / 180.0;
  glm::dvec3 forward = target - view.position;
  const double length = glm::length(forward);
  forward = std::isfinite(length) && length > 1e-12 ? forward / length : glm::dvec3(0, 0, -1);
  glm::dvec3 up(0, 1, 0);
  if (glm::length(glm::cross(forward, up)) < 1e-6) up = glm::dvec3(0, 0, -1);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, up));
  view.orientation = glm::normalize(glm::quat_cast(glm::dmat3(right, glm::cross(right, forward), -forward)));
  return view;
}

wire::Pose to_pose(const View& view) {
  wire::Pose pose;
  pose.mutable_position()->set_x(view.position.x);
  pose.mutable_position()->set_y(view.position.y);
  pose.mutable_position()->set_z(view.position.z);
  pose.set_qw(static_cast<float>(view.orientation.w));
  pose.set_qx(static_cast<float>(view.orientation.x));
  pose.set_qy(static_cast<float>(view.orientation.y));
  pose.set_qz(static_cast<float>(view.orientation.z));
  pose.set_fovy(static_cast<float>(view.fovy));
  pose.set_width(view.width);
  pose.set_height(view.height);
  return pose;
}

bool from_pose(const wire::Pose& pose, View& view) {
  View v;
  v.position = {pose.position().x(), pose.position().y(), pose.position().z()};
  v.orientation = glm::dquat(pose.qw(), pose.qx(), pose.qy(), pose.qz());
  v.fovy = pose.fovy();
  v.width = pose.width();
  v.height = pose.height();
  const double norm = glm::length(v.orientation);
  if (!finite(v.position) || !std::isfinite(norm) || std::abs(norm - 1.0) > 1e-2) return false;
  if (!(v.fovy > 1e-3 && v.fovy < 3.14)) return false;
  if (v.width < 1 || v.height < 1 || v.width > kMaxSide || v.height > kMaxSide) return false;
  v.orientation = glm::normalize(v.orientation);
  view = v;
  return true;
}

glm::dmat4 view_matrix(const View& view, const glm::dvec3& origin) {
  const glm::dmat3 to_camera = glm::transpose(glm::mat3_cast(view.orientation));
  glm::dmat4 m(to_camera);
  m[3] = glm::dvec4(to_camera * (origin - view.position), 1.0);
  return m;
}

glm::dmat4 projection_matrix(const View& view, double near_plane, double far_plane, bool reversed_zero_to_one) {
  const double f = 1.0 / std::tan(view.fovy * 0.5);
  const double aspect = static_cast<double>(view.width) / view.height;
  glm::dmat4 m(0.0);
  m[0][0] = f / aspect;
  m[1][1] = f;
  m[2][3] = -1.0;
  if (reversed_zero_to_one) {
    m[3][2] = near_plane;
  } else {
    m[2][2] = (far_plane + near_plane) / (near_plane - far_plane);
    m[3][2] = 2.0 * far_plane * near_plane / (near_plane - far_plane);
  }
  return m;
}

}  // namespace darm::client
