// What a picture loses where it is drawn from coarser texels than its pixels ask for.
#pragma once

namespace darm::tile_scheduler {

/// RMS display error (0..1) of a sample drawn so many octaves coarser than sharp, beside noise: as measured (see
/// ARCHITECTURE), linear between whole octaves, constant past the last. 0 for 0 or less and NaN.
[[nodiscard]] float error_of_coarser(float octaves);

/// Octaves that a level-0 texel is too large for a pixel whose footprint's minor axis is `pixel_texels` of them: 0 from
/// one texel on, else -log2. What is not a positive number counts as none: a footprint that could not be told.
[[nodiscard]] float octaves_magnified(float pixel_texels);

}  // namespace darm::tile_scheduler
