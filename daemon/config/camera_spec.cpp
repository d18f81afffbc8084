#include "daemon/config/camera_spec.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace darm::config {
namespace {

constexpr std::string_view kForm = "\"px,py,pz tx,ty,tz fovy_degrees\"";

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const auto end = text.find(separator);
    const auto part = text.substr(0, end);
    if (separator != ' ' || !part.empty()) parts.push_back(part);
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::optional<double> number(std::string_view text, double low, double high) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (!std::isfinite(value) || value < low || value > high) return std::nullopt;
  return value;
}

std::optional<glm::dvec3> point(std::string_view text) {
  const auto parts = split(text, ',');
  if (parts.size() != 3) return std::nullopt;
  glm::dvec3 result;
  for (int i = 0; i < 3; ++i) {
    const auto value = number(parts[static_cast<std::size_t>(i)], -1e7, 1e7);
    if (!value) return std::nullopt;
    result[i] = *value;
  }
  return result;
}

// What may be written; set-ups like to name cameras as their scene does.
std::string names_of(std::span<const Pose> poses, std::span<const scene::NamedCamera> scene_cameras) {
  std::vector<std::string> names;
  const auto add = [&](const std::string& name) {
    if (!name.empty() && std::ranges::find(names, name) == names.end()) names.push_back(name);
  };
  for (const auto& pose : poses) add(pose.name);
  for (const auto& camera : scene_cameras) add(camera.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

Camera camera_of(const Pose& pose) { return look_at(pose.position, pose.target, pose.fovy_degrees); }

Result<Camera> parse_camera_spec(std::string_view spec, std::span<const Pose> poses,
                                 std::span<const scene::NamedCamera> scene_cameras) {
  for (const auto& pose : poses)
    if (pose.name == spec) return camera_of(pose);
  for (const auto& camera : scene_cameras)
    if (camera.name == spec && !spec.empty()) return camera.camera;

  const auto parts = split(spec, ' ');
  if (parts.size() < 2 || parts.size() > 3 || spec.find(',') == std::string_view::npos) {
    const auto names = names_of(poses, scene_cameras);
    return fail(fmt::format("camera \"{}\": no such name{}; write one of them or {}", spec.substr(0, 100),
                            names.empty() ? " (the set-up names none)" : " among " + names, kForm));
  }
  const auto position = point(parts[0]);
  if (!position)
    return fail(fmt::format("camera position \"{}\": not three numbers within 1e7; write {}", parts[0], kForm));
  const auto target = point(parts[1]);
  if (!target)
    return fail(fmt::format("camera target \"{}\": not three numbers within 1e7; write {}", parts[1], kForm));
  if (*position == *target) return fail(fmt::format("camera \"{}\": it looks at where it stands", spec));
  double fovy = 60;
  if (parts.size() == 3) {
    const auto given = number(parts[2], 1, 179);
    if (!given) return fail(fmt::format("camera fovy \"{}\": not a number of degrees from 1 to 179", parts[2]));
    fovy = *given;
  }
  return look_at(*position, *target, fovy);
}

}  // namespace darm::config
