// What a tile looks like: the display-ready content of one slot.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "actors/types/tile_id.hpp"

namespace darm {

/// Alpha of one slot, 32x32 row-major, 255 is opaque. Static per tile (alpha does not depend on light).
using CoverageTile = std::array<std::uint8_t, kSlotTexels>;

/// What a clear surface passes of the light behind it, one slot, 32x32x3 row-major, sRGB-encoded. Static per tile.
using ThroughTile = std::array<std::uint8_t, kSlotTexels * 3>;

/// A slot's picture with its border, ready to copy into a frame. Immutable once made; shared between rooms.
/// `rgb` is sRGB-encoded, interleaved, row-major; `y`/`cb`/`cr` are the same picture in full-range BT.709 4:2:0 with
/// centre-sited chroma. Texels that were never shaded are filled from their neighbours, never black.
struct TileImage {
  std::array<std::uint8_t, kSlotTexels * 3> rgb;
  std::array<std::uint8_t, kSlotTexels> y;
  std::array<std::uint8_t, kSlotTexels / 4> cb;
  std::array<std::uint8_t, kSlotTexels / 4> cr;
  std::shared_ptr<const CoverageTile> coverage;  ///< null: fully opaque
  std::shared_ptr<const ThroughTile> through;    ///< private layer only; null: nothing in the tile is clear
};

}  // namespace darm
