// A camera path over time, played with smooth interpolation.
#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "actors/types/camera.hpp"
#include "actors/types/error.hpp"

namespace darm::config {

/// One entry of a walkthrough: where the camera is at `t` seconds, file coordinates.
struct PathPose {
  double t = 0;
  glm::dvec3 position{0.0};
  glm::dvec3 target{0.0, 0.0, -1.0};
  double fovy_degrees = 60;
};

/// Interpolates position, target and fovy by cubic Hermite splines with Catmull-Rom tangents for uneven times, so that
/// the path goes through every entry with a continuous velocity. A value; thread-safe to read.
class Walkthrough {
 public:
  /// `poses`: 1 to 10,000, t strictly increasing and >= 0, numbers finite, |coordinates| <= 1e7, fovy 1..179.
  [[nodiscard]] static Result<Walkthrough> make(std::vector<PathPose> poses);
  /// JSON: [{"t": s, "position": [x,y,z], "target": [x,y,z], "fovy": degrees}, ...]; other keys are an error.
  /// `name` is what errors begin with.
  [[nodiscard]] static Result<Walkthrough> parse(std::string_view json, const std::string& name);
  /// Reads a file of at most 4 MiB.
  [[nodiscard]] static Result<Walkthrough> load(const std::filesystem::path& file);

  [[nodiscard]] double start() const { return poses_.front().t; }
  [[nodiscard]] double end() const { return poses_.back().t; }
  /// The pose at `t` seconds, held at the first and last entry outside of the path (and for NaN).
  [[nodiscard]] PathPose at(double t) const;
  [[nodiscard]] Camera camera_at(double t) const;
  [[nodiscard]] const std::vector<PathPose>& poses() const { return poses_; }

 private:
  explicit Walkthrough(std::vector<PathPose> poses) : poses_(std::move(poses)) {}
  std::vector<PathPose> poses_;
};

}  // namespace darm::config
