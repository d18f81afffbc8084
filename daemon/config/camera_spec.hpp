// The camera SPEC of the command line: "px,py,pz tx,ty,tz fovy_degrees", or a name.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "actors/scene/scene.hpp"
#include "actors/types/camera.hpp"
#include "actors/types/error.hpp"
#include "daemon/config/config.hpp"

namespace darm::config {

/// The camera `spec` stands for: a name from `poses` (the set-up), else one of `scene_cameras` (glTF), else numbers:
/// position and target in file coordinates (|x| <= 1e7) and fovy in 1..179 degrees (60 if left out), separated by
/// spaces. An unknown name is an error that lists the known ones.
[[nodiscard]] Result<Camera> parse_camera_spec(std::string_view spec, std::span<const Pose> poses,
                                               std::span<const scene::NamedCamera> scene_cameras);

/// The camera of a pose.
[[nodiscard]] Camera camera_of(const Pose& pose);

}  // namespace darm::config
