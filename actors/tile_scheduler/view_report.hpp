// What one view needs of an atlas: texels read and tiles touched, exactly as the client's four samples a pixel do.
#pragma once

#include <cstdint>
#include <functional>

#include "actors/tile_scheduler/view_sampler.hpp"

namespace darm::tile_scheduler {

/// Calls visit(thread, surface, weight) for every surface of every client sample (kClientSamples of each pixel); the
/// weights of a picture's samples sum to at most 1 per layer. `threads` (at least 1) threads call at once, each with
/// its own `thread` number; rows come in no order.
void for_each_client_sample(const atlas::Layout& layout, const renderer::trace::RayScene& rays, const Camera& camera,
                            const Viewport& viewport, unsigned threads,
                            const std::function<void(unsigned thread, const SurfaceSample&, float weight)>& visit);

/// Figures of `darmd inspect --camera`.
struct ViewReport {
  std::uint64_t visible_texels = 0;  ///< distinct texels that bilinear taps at the sharp level read
  std::uint64_t visible_tiles = 0;   ///< distinct tiles that hold a sample's position at its sharp level
  double efficiency = 0;             ///< visible_texels / (900 * visible_tiles); 0 without tiles
  double covered = 0;                ///< share of samples that hit a surface
};

/// Works on any layout of the scene, also one with other placements (the paper's packing beside ours). A patch that the
/// layout does not place inside its level is clamped to it. Blocks until done.
[[nodiscard]] ViewReport report_view(const atlas::Layout& layout, const renderer::trace::RayScene& rays,
                                     const Camera& camera, const Viewport& viewport, unsigned threads);

}  // namespace darm::tile_scheduler
