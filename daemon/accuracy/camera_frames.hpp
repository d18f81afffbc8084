// The plain alternative: the same integrator tracing camera frames on the same cores; and effects left out of it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "actors/renderer/reference_renderer.hpp"
#include "daemon/accuracy/picture_error.hpp"
#include "daemon/accuracy/report/measurement.hpp"

namespace darm::accuracy {

/// False: the run is to be given up.
using KeepGoing = std::function<bool()>;

struct TracedFrames {
  std::vector<Point> curve;
  bool stopped = false;
};

/// Traces `job` (view, exposure, threads, effects; seeds of its own) with 1, 2, 4, 6, 8, 12, ... samples a pixel until
/// `seconds` of tracing are over; two samples at least. Time is that of tracing alone. `file`: for its sums, made and
/// removed. `progress`: told the seconds traced so far; may be empty. Errors as render_reference().
[[nodiscard]] Result<TracedFrames> trace_frames(const renderer::LightTransport& transport, renderer::ReferenceJob job,
                                                const ShownHalves& reference, const PixelMask& counted, double seconds,
                                                const std::filesystem::path& file, const KeepGoing& keep_going,
                                                const std::function<void(double)>& progress);

/// Two halves of the same number of samples, for difference().
struct TracedHalves {
  Halves halves;
  double seconds_per_sample = 0;  ///< of all pixels: processor time by threads, whatever else the machine does
  std::uint32_t spp = 0;          ///< both halves together
  bool stopped = false;
};

/// Traces `job` with `spp` samples a pixel; nothing is kept on disk. Nothing else may run in the process meanwhile.
[[nodiscard]] Result<TracedHalves> trace_halves(const renderer::LightTransport& transport, renderer::ReferenceJob job,
                                                std::uint32_t spp, const KeepGoing& keep_going);

}  // namespace darm::accuracy
