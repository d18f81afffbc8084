// Where a client without hands looks: a camera given in words, a named one of a set-up file, or a walkthrough over
// time.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/core/result.hpp"
#include "client/core/view.hpp"

namespace darm::client {

struct CameraKey {
  double t = 0;  ///< seconds
  glm::dvec3 position{0.0};
  glm::dvec3 target{0, 0, -1};
  double fovy = 60;  ///< degrees
};

/// `spec`: "px,py,pz tx,ty,tz fovy_degrees", or the name of a [[cameras]] or [[load_cameras]] entry of the TOML file
/// `setup` (may be empty).
[[nodiscard]] Result<CameraKey> read_camera(const std::string& spec, const std::filesystem::path& setup);
/// The [[load_groups]] of a set-up: where groups of clients stand, at least one.
[[nodiscard]] Result<std::vector<CameraKey>> read_load_groups(const std::filesystem::path& setup);
/// The [[load_cameras]] of a set-up: still cameras along its walkthrough, at least one.
[[nodiscard]] Result<std::vector<CameraKey>> read_load_cameras(const std::filesystem::path& setup);
/// JSON list of {"t", "position", "target", "fovy"}, times rising, at least two.
[[nodiscard]] Result<std::vector<CameraKey>> read_walkthrough(const std::filesystem::path& file);
/// Cubic Hermite with central-difference tangents (Catmull-Rom with uneven times); held at both ends.
[[nodiscard]] CameraKey camera_at(const std::vector<CameraKey>& path, double t);
[[nodiscard]] View to_view(const CameraKey& key, std::uint32_t width, std::uint32_t height);

}  // namespace darm::client
