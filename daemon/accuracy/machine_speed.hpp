// How fast the machine is at the moment: other work on it shows.
#pragma once

#include "actors/renderer/trace/ray_scene.hpp"
#include "actors/types/camera.hpp"

namespace darm::accuracy {

/// Rays per second that `threads` threads find closest hits for, all over the camera's picture, in about `seconds` of
/// time as it passes.
[[nodiscard]] double rays_per_second(const renderer::trace::RayScene& rays, const Camera& camera, unsigned threads,
                                     double seconds);

}  // namespace darm::accuracy
