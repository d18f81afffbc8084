// The plain alternative: the same integrator tracing camera frames, on the same cores.
#pragma once

#include <optional>
#include <vector>

#include "actors/renderer/reference_renderer.hpp"
#include "client/core/image_metrics.hpp"

namespace darm::bench {

struct FramePoint {
  double seconds = 0;  ///< of rendering, nothing else
  double spp = 0;
  double psnr = 0;
};

/// Renders `job` (its seeds must not be the reference's) with 1, 2, 4, 6, 8, 12, ... samples a pixel until it is at
/// `target` dB, or `most_spp`.
[[nodiscard]] Result<std::vector<FramePoint>> trace_frames(const renderer::LightTransport& transport,
                                                           renderer::ReferenceJob job,
                                                           const client::Reference& reference, double target,
                                                           std::uint32_t most_spp);

/// Time to `target`: between two points log time goes with dB (noise falls as 1/n). nullopt: not reached.
[[nodiscard]] std::optional<double> time_to(const std::vector<FramePoint>& points, double target);

/// The same scene's pictures: linear floats of a reference half for the client's comparison.
[[nodiscard]] client::ImageF to_image(const renderer::Picture& picture);

}  // namespace darm::bench
