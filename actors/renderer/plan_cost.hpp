// What the effect plan saves, and what each effect costs, measured on a scene's own paths.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "actors/renderer/light_transport.hpp"
#include "actors/types/camera.hpp"
#include "actors/types/error.hpp"

namespace darm::renderer {

/// Camera paths of one view: what is measured on.
struct CostView {
  Camera camera;
  Viewport viewport{320, 180};
  double seconds = 1;  ///< of processor time, for each comparison
};

/// Two integrators on the same paths in turn, slice by slice, on the calling thread, by its processor time.
struct SpeedRatio {
  double rate = 0;                       ///< paths a second of the first
  double peer = 0;                       ///< of the second
  double ratio = 0;                      ///< rate / peer of all slices together
  double low = 0, median = 0, high = 0;  ///< quartiles of the slices' ratios
  std::uint64_t paths = 0;
  std::uint64_t different = 0;  ///< paths whose light was not the same, bit by bit
};

/// Every effect included (full_radiance). At least one slice, so a pixel's row, is taken.
[[nodiscard]] SpeedRatio compare_speed(const LightTransport& first, const LightTransport& second, const CostView& view);

/// The time of a path with an effect over the time without it: the scene as it is against a copy that lacks it, each
/// under its own plan. Light changes too, so paths grow longer or shorter: that is part of what the effect costs.
struct EffectCost {
  std::string effect;  ///< scene::Effect::name
  double ratio = 1;    ///< above 1: the effect costs time
  double low = 1, high = 1;
};

/// Of each effect that the plan needs and that can be taken out. A ray-library scene is built for each.
[[nodiscard]] Result<std::vector<EffectCost>> measure_effects(const LightTransport& transport, const CostView& view,
                                                              unsigned threads);

struct PlanCost {
  SpeedRatio planned;   ///< the planned integrator over the one with every effect; the same rays, so the same light
  SpeedRatio filtered;  ///< the same over the latter on rays that call back for every triangle, masked or not. Where
                        ///< faces coincide the ray library then picks another of them: `different` may be above 0
};
[[nodiscard]] Result<PlanCost> measure_plan(const LightTransport& transport, const CostView& view, unsigned threads);

}  // namespace darm::renderer
