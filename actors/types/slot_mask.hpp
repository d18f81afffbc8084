// Which of a slot's 32x32 texels somebody sees, its border included.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "actors/types/tile_id.hpp"

namespace darm {

/// A set of texels of one slot; bit y * 32 + x. A value of 128 bytes.
class SlotMask {
 public:
  /// Columns x0..x1 of row y, inclusive; all within [0, 31].
  constexpr void set_row(int y, int x0, int x1) {
    const std::uint32_t row =
        (0xffffffffu >> static_cast<unsigned>(31 - x1)) & (0xffffffffu << static_cast<unsigned>(x0));
    rows_[static_cast<std::size_t>(y)] |= row;
  }
  [[nodiscard]] constexpr bool test(int at) const {
    return (rows_[static_cast<std::size_t>(at) >> 5] >> (static_cast<unsigned>(at) & 31u)) & 1u;
  }
  constexpr SlotMask& operator|=(const SlotMask& other) {
    for (std::size_t i = 0; i < rows_.size(); ++i) rows_[i] |= other.rows_[i];
    return *this;
  }
  [[nodiscard]] constexpr int count() const {
    int n = 0;
    for (const auto row : rows_) n += std::popcount(row);
    return n;
  }
  constexpr bool operator==(const SlotMask&) const = default;

 private:
  std::array<std::uint32_t, kSlotSize> rows_{};
};

}  // namespace darm
