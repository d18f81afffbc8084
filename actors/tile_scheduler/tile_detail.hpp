// How much of a tile's picture a coarser level would lose.
#pragma once

#include "actors/types/tile_image.hpp"

namespace darm::tile_scheduler {

/// Mean squared difference (8-bit luma, 0..65025) between the tile's payload and its 2x2 box average: what halving the
/// density takes away.
[[nodiscard]] float detail_of(const TileImage& image);

/// Factor on a chain's losses for a tile of this detail, `usual` being the mean over the view: detail / usual as a
/// power of two within 1/16 .. 8. Coarse steps, so that light which still converges does not move slots about.
[[nodiscard]] float detail_factor(float detail, float usual);

}  // namespace darm::tile_scheduler
