// The picture of a stream: PhysTex as planes, ready for the codec. Only changed slots are written.
#pragma once

#include <cstdint>

#include "actors/encoder/yuv_convert.hpp"
#include "actors/types/ids.hpp"
#include "actors/types/tile_image.hpp"

namespace darm::encoder {

/// A square of 32x32 slots. Slot = row * slots_per_row + column. Slots never written are mid-grey.
class PhysTexPicture {
 public:
  /// `size`: pixels per side, a multiple of 32, 32..8192.
  PhysTexPicture(std::uint32_t size, bool chroma_444);

  /// Copies a tile into its slot: three planes as they are for 4:2:0; for 4:4:4 chroma comes from `image.rgb`.
  /// False if there is no such slot.
  bool write(SlotIndex slot, const TileImage& image);

  [[nodiscard]] PlanarPicture view() const { return picture_.view(); }
  [[nodiscard]] std::uint32_t slot_count() const { return slots_per_row_ * slots_per_row_; }

 private:
  void write_chroma_444(std::uint32_t x, std::uint32_t y, const TileImage& image);

  std::uint32_t slots_per_row_;
  bool chroma_444_;
  OwnedPicture picture_;
};

}  // namespace darm::encoder
