// What lies under a point of the window: a ray against the geometry that has come. Pure.
#pragma once

#include <glm/vec3.hpp>
#include <optional>

#include "client/core/scene_model.hpp"
#include "client/desktop/upright_view.hpp"

namespace darm::client::desktop {

/// Distance along `direction` (unit) from `origin`, both recentred; nothing: nothing is hit.
[[nodiscard]] std::optional<double> pick(const SceneModel& scene, const glm::dvec3& origin,
                                         const glm::dvec3& direction);
/// The point (file coordinates) that is seen at (x, y): shares of the window's height from its middle, y up.
[[nodiscard]] std::optional<glm::dvec3> point_under(const SceneModel& scene, const UprightView& view, double x,
                                                    double y);

}  // namespace darm::client::desktop
