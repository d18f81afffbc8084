// What a view loses where it is drawn from a coarser level than the sharp one, measured on the pictures there are.
#pragma once

#include <span>
#include <vector>

#include "actors/tile_scheduler/chain.hpp"
#include "actors/tile_scheduler/stream_state.hpp"

namespace darm::tile_scheduler {

struct LossOptions {
  /// An octave finer than the finest picture there is loses this share of the octave beside it. Textures and shadow
  /// edges have about as much energy in each octave; noise has more in the finest, which is why it is under 1.
  float finer_octave = 0.8f;
  /// Squared error of CoarseTex that is not in CoarseLuma: a million texels in 300 kB come back some 35 dB right.
  float coarse_error = 20.0f;
  /// Samples' worth of the tile's mean that a chain's own mean is drawn to: chains of one or two samples are noise.
  float prior_samples = 1.0f;
};

/// Loss of each chain by the position that serves it: mean squared difference (8-bit luma, so 0..65025) to the picture
/// drawn from the sharp level, at the samples of `taps`. Rises with the position. A level without a picture is judged
/// from the finest one there is: coarser ones by halving it, finer ones by `finer_octave`. Chains that no tap saw take
/// the mean of their tile, else of the view. Empty if no tap has a picture. `taps` name chains by their number in
/// `chains`. `coarse` may be null: then CoarseTex, too, is judged by halving. Pure.
[[nodiscard]] std::vector<ChainLoss> measure_losses(std::span<const WeightedChain> chains,
                                                    std::span<const SampleTaps> taps, const ImageLookup& images,
                                                    const CoarseLuma* coarse, int coarse_level,
                                                    const LossOptions& options = {});

}  // namespace darm::tile_scheduler
