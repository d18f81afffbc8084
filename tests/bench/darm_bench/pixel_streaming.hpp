// The other way to show a ray-traced scene on thin devices: a server path-traces each client's camera and sends it the
// coded pictures. Same integrator, same codec, same threads.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/renderer/reference_renderer.hpp"
#include "client/core/image_metrics.hpp"

namespace darm::bench {

struct PixelPoint {
  double t = 0;  ///< seconds of tracing and coding for all clients, nothing else
  double psnr = 0;
  std::uint64_t bytes = 0;  ///< sent to this client until then
};

struct PixelClient {
  std::vector<PixelPoint> series;
  std::uint64_t updates = 0;
  std::uint64_t bytes = 0;
};

struct PixelStreamingOptions {
  double target_db = 30;
  double most_seconds = 300;
  float crf = 18;  ///< as fine as DARM's streams get
};

struct PixelStreamingRun {
  std::vector<PixelClient> clients;
  double seconds = 0;
};

/// In turns, each client's still camera gets one more sample a pixel, and the mean so far is coded and sent: the best
/// that pixel streaming can do for a client that stands still. Ends once every client's decoded picture is at the
/// target. One picture of many is scored, beside the clock. `layout`: any of the scene.
[[nodiscard]] Result<PixelStreamingRun> stream_pixels(const renderer::LightTransport& transport,
                                                      std::span<const renderer::ReferenceJob> jobs,
                                                      std::span<const client::Reference> references,
                                                      const atlas::Layout& layout,
                                                      const PixelStreamingOptions& options);

/// First time at which the series is at `target`; nullopt: never.
[[nodiscard]] std::optional<PixelPoint> point_at(const PixelClient& client, double target);

}  // namespace darm::bench
