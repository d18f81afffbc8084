#include "daemon/config/walkthrough.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

namespace darm::config {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxPoses = 10'000;
constexpr std::uintmax_t kMaxFileBytes = 4u << 20;
constexpr double kMaxCoordinate = 1e7;

bool in_range(const glm::dvec3& v) {
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(v[i]) || std::abs(v[i]) > kMaxCoordinate) return false;
  return true;
}

Result<double> number(const json& entry, const char* key) {
  const auto it = entry.find(key);
  if (it == entry.end()) return fail(fmt::format("{} is missing", key));
  if (!it->is_number()) return fail(fmt::format("{} is not a number", key));
  return it->get<double>();
}

Result<glm::dvec3> vector3(const json& entry, const char* key) {
  const auto it = entry.find(key);
  if (it == entry.end()) return fail(fmt::format("{} is missing", key));
  glm::dvec3 v;
  if (!it->is_array() || it->size() != 3) return fail(fmt::format("{} is not a list of three numbers", key));
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(*it)[i].is_number()) return fail(fmt::format("{} is not a list of three numbers", key));
    v[static_cast<int>(i)] = (*it)[i].get<double>();
  }
  return v;
}

Result<PathPose> read_pose(const json& entry) {
  if (!entry.is_object()) return fail("is not an object");
  for (const auto& [key, value] : entry.items())
    if (key != "t" && key != "position" && key != "target" && key != "fovy")
      return fail("has an unknown key; known are t, position, target, fovy");
  const auto t = number(entry, "t");
  if (!t) return std::unexpected(t.error());
  const auto position = vector3(entry, "position");
  if (!position) return std::unexpected(position.error());
  const auto target = vector3(entry, "target");
  if (!target) return std::unexpected(target.error());
  const auto fovy = number(entry, "fovy");
  if (!fovy) return std::unexpected(fovy.error());
  return PathPose{*t, *position, *target, *fovy};
}

// Tangent (per second) of `value` at entry i: the mean of the slopes on both sides weighted so that uneven times keep
// a parabola exact; one-sided at the ends.
template <class T>
T tangent(const std::vector<PathPose>& poses, std::size_t i, T PathPose::* value) {
  const auto slope = [&](std::size_t k) {
    return (poses[k + 1].*value - poses[k].*value) / (poses[k + 1].t - poses[k].t);
  };
  if (i == 0) return slope(0);
  if (i + 1 == poses.size()) return slope(i - 1);
  const double before = poses[i].t - poses[i - 1].t;
  const double after = poses[i + 1].t - poses[i].t;
  return (slope(i - 1) * after + slope(i) * before) / (before + after);
}

template <class T>
T hermite(const std::vector<PathPose>& poses, std::size_t i, double s, T PathPose::* value) {
  const double dt = poses[i + 1].t - poses[i].t;
  const double s2 = s * s;
  const double s3 = s2 * s;
  return poses[i].*value * (2 * s3 - 3 * s2 + 1) + tangent(poses, i, value) * (dt * (s3 - 2 * s2 + s)) +
         poses[i + 1].*value * (3 * s2 - 2 * s3) + tangent(poses, i + 1, value) * (dt * (s3 - s2));
}

}  // namespace

Result<Walkthrough> Walkthrough::make(std::vector<PathPose> poses) {
  if (poses.empty()) return fail("has no entries; one is the least");
  if (poses.size() > kMaxPoses) return fail(fmt::format("has {} entries; {} is the most", poses.size(), kMaxPoses));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto& p = poses[i];
    const auto bad = [i](const char* what) { return fail(fmt::format("entry {}: {}", i, what)); };
    if (!std::isfinite(p.t) || p.t < 0 || p.t > 1e6) return bad("t is not in 0..1e6 seconds");
    if (i > 0 && p.t - poses[i - 1].t < 1e-6) return bad("t is not after that of the entry before");
    if (!in_range(p.position)) return bad("position is not within 1e7 of the origin");
    if (!in_range(p.target)) return bad("target is not within 1e7 of the origin");
    if (p.position == p.target) return bad("target is the position");
    if (!(p.fovy_degrees >= 1 && p.fovy_degrees <= 179)) return bad("fovy is not in 1..179 degrees");
  }
  return Walkthrough(std::move(poses));
}

Result<Walkthrough> Walkthrough::parse(std::string_view text, const std::string& name) {
  const json list = json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (list.is_discarded()) return fail(name + ": is not JSON");
  if (!list.is_array()) return fail(name + ": is not a list of {t, position, target, fovy}");
  if (list.size() > kMaxPoses)
    return fail(fmt::format("{}: has {} entries; {} is the most", name, list.size(), kMaxPoses));
  std::vector<PathPose> poses;
  poses.reserve(list.size());
  for (const auto& entry : list) {
    auto pose = read_pose(entry);
    if (!pose) return fail(fmt::format("{}: entry {}: {}", name, poses.size(), pose.error().message));
    poses.push_back(*pose);
  }
  auto walkthrough = make(std::move(poses));
  if (!walkthrough) return std::unexpected(walkthrough.error().within(name));
  return walkthrough;
}

Result<Walkthrough> Walkthrough::load(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (error || !std::filesystem::is_regular_file(status)) return fail(file.string() + ": cannot be read: no such file");
  const auto size = std::filesystem::file_size(file, error);
  if (error || size > kMaxFileBytes) return fail(file.string() + ": is over 4 MiB; a walkthrough is not that long");
  std::ifstream in(file, std::ios::binary);
  std::string text(static_cast<std::size_t>(size), '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!in && size > 0) return fail(file.string() + ": cannot be read: is it ours to read?");
  return parse(text, file.string());
}

PathPose Walkthrough::at(double t) const {
  if (!(t > start())) return poses_.front();
  if (t >= end()) return poses_.back();
  const auto after =
      std::upper_bound(poses_.begin(), poses_.end(), t, [](double x, const PathPose& p) { return x < p.t; });
  const auto i = static_cast<std::size_t>(after - poses_.begin()) - 1;
  const double s = (t - poses_[i].t) / (poses_[i + 1].t - poses_[i].t);
  PathPose pose;
  pose.t = t;
  pose.position = hermite(poses_, i, s, &PathPose::position);
  pose.target = hermite(poses_, i, s, &PathPose::target);
  pose.fovy_degrees = std::clamp(hermite(poses_, i, s, &PathPose::fovy_degrees), 1.0, 179.0);
  return pose;
}

Camera Walkthrough::camera_at(double t) const {
  const PathPose pose = at(t);
  return look_at(pose.position, pose.target, pose.fovy_degrees);
}

}  // namespace darm::config
