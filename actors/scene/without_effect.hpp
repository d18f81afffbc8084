// The same scene with one effect taken out: for measuring what the effect costs.
#pragma once

#include <memory>
#include <string_view>

#include "actors/scene/scene.hpp"

namespace darm::scene {

/// A copy without the effect of that name (Effect::name), everything else as it is. Its plan does not need the effect.
/// Null for names that no light depends on (movable things, the private layer, diffuse interreflection).
[[nodiscard]] std::shared_ptr<const Scene> without_effect(const Scene& scene, std::string_view effect);

}  // namespace darm::scene
