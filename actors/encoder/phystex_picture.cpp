#include "actors/encoder/phystex_picture.hpp"

#include <cstring>

namespace darm::encoder {

PhysTexPicture::PhysTexPicture(std::uint32_t size, bool chroma_444)
    : slots_per_row_(size / kSlotSize), chroma_444_(chroma_444), picture_(size, size, chroma_444) {}

bool PhysTexPicture::write(SlotIndex slot, const TileImage& image) {
  if (slot >= slot_count()) return false;
  const std::uint32_t x = slot % slots_per_row_ * kSlotSize;
  const std::uint32_t y = slot / slots_per_row_ * kSlotSize;
  for (std::uint32_t r = 0; r < kSlotSize; ++r) {
    std::memcpy(picture_.row(0, y + r) + x, image.y.data() + r * kSlotSize, kSlotSize);
  }
  if (chroma_444_) {
    write_chroma_444(x, y, image);
    return true;
  }
  constexpr std::uint32_t kHalf = kSlotSize / 2;
  for (std::uint32_t r = 0; r < kHalf; ++r) {
    std::memcpy(picture_.row(1, y / 2 + r) + x / 2, image.cb.data() + r * kHalf, kHalf);
    std::memcpy(picture_.row(2, y / 2 + r) + x / 2, image.cr.data() + r * kHalf, kHalf);
  }
  return true;
}

void PhysTexPicture::write_chroma_444(std::uint32_t x, std::uint32_t y, const TileImage& image) {
  for (std::uint32_t r = 0; r < kSlotSize; ++r) {
    const auto* rgb = image.rgb.data() + r * kSlotSize * 3;
    auto* cb = picture_.row(1, y + r) + x;
    auto* cr = picture_.row(2, y + r) + x;
    for (std::uint32_t c = 0; c < kSlotSize; ++c) {
      const auto ycc = to_ycc(rgb[c * 3], rgb[c * 3 + 1], rgb[c * 3 + 2]);
      cb[c] = ycc.cb;
      cr[c] = ycc.cr;
    }
  }
}

}  // namespace darm::encoder
