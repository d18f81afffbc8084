// How many samples texels are worth that everything else hears of.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "actors/atlas/radiance_store.hpp"
#include "actors/renderer/bright_texels.hpp"
#include "actors/renderer/renderer_messages.hpp"

namespace darm::renderer {

/// One bright texel (BrightTexels). All finite, >= 0.
struct BrightMeasure {
  float flux = 0;       ///< radiance times area
  float deviation = 0;  ///< of one of its samples, likewise
  float samples = 0;    ///< that it has
};

/// How many samples each should have, so that the standard error of their summed flux is `tolerance` (> 0) of it; 0
/// where it is about that already. The same for all: the filter gives more weight to a texel of more samples, and would
/// make a spot's rim as bright as its middle. A power of two; about kSamplesOfBright in all at most.
[[nodiscard]] std::uint32_t bright_samples(std::span<const BrightMeasure> texels, float tolerance);
inline constexpr double kSamplesOfBright = 1 << 17;

/// Soft light alone: sharp light is good from the first sample on. `level`: the coarse one.
[[nodiscard]] std::vector<BrightMeasure> measure_bright(const BrightTexels& bright, const atlas::RadianceStore& store,
                                                        int level);
/// Each of them.
[[nodiscard]] std::vector<CoarseRequest> requests_of(const BrightTexels& bright);

}  // namespace darm::renderer
