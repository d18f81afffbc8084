// The one exposure of a scene, from its light and never from a camera.
#pragma once

#include <cstdint>

#include "actors/renderer/light_transport.hpp"

namespace darm::renderer {

/// Exposure under which a diffuse surface in the scene's mean irradiance E shows its own albedo: pi / E, so a mid-grey
/// of 0.35 is displayed as linear 0.35. E is the square of the mean square root of the luminance of irradiance over
/// `points` surface points, uniform by area, fronts only, 8 samples each: the root keeps a small bright part (a sunlit
/// roof) from setting the exposure of the rest. Where other samples of a point do not find the light of the first (a
/// room lit over a small bright spot): of the mean of 32 points that lie together, 64 samples each. Deterministic. 1 if
/// no light reaches any surface.
[[nodiscard]] float scene_exposure(const LightTransport& transport, std::uint32_t points = 2048);

}  // namespace darm::renderer
