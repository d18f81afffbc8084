// Where a scene's chunks lie for a view: what is not in its picture is not drawn, what is near comes first. Pure.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "client/core/scene_model.hpp"
#include "client/core/view.hpp"

namespace darm::client {

/// From recentred world space to clip space, with planes that hold all of the scene. `reversed`: depth 1 is near, 0
/// far.
[[nodiscard]] glm::dmat4 world_to_clip(const SceneModel& scene, const View& view, bool reversed);

/// True if all corners of the chunk's box are outside one plane of the view's pyramid; the far plane does not count.
/// `to_clip`: from the chunk's node space.
[[nodiscard]] bool outside(const Chunk& chunk, const glm::dmat4& to_clip);

/// Of the chunk's box, in recentred world space.
[[nodiscard]] glm::vec3 centre(const Chunk& chunk, const InstanceShape& instance);

}  // namespace darm::client
