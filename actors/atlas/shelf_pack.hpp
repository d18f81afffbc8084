// The paper's packing (3.1), kept as the peer that ours is measured against: never used to serve.
#pragma once

#include "actors/atlas/layout.hpp"

namespace darm::atlas {

/// Level 0 packed as the paper does: bounding boxes with their gutters, by falling height, on shelves, in one square
/// whose side is a power of two. `tiles_x`, `tiles_y` round up, since such a square is no whole number of tiles.
[[nodiscard]] Level shelf_pack(const Layout& layout);

}  // namespace darm::atlas
