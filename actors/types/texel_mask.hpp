// Which of a tile's 30x30 payload texels somebody sees.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "actors/types/tile_id.hpp"

namespace darm {

/// A set of payload texels of one tile; bit y * 30 + x. A value of 120 bytes.
class TexelMask {
 public:
  constexpr void set(int x, int y) {
    const auto bit = static_cast<unsigned>(y * kTileSize + x);
    words_[bit >> 6] |= std::uint64_t{1} << (bit & 63u);
  }
  /// Texels x0..x1 of row y; 0 <= x0 <= x1 < 30.
  constexpr void set_row(int x0, int x1, int y) {
    const auto first = static_cast<unsigned>(y * kTileSize + x0);
    const std::uint64_t run = (std::uint64_t{1} << static_cast<unsigned>(x1 - x0 + 1)) - 1;
    const unsigned shift = first & 63u;
    words_[first >> 6] |= run << shift;
    if (const auto beyond = run >> (63u - shift) >> 1; beyond != 0) words_[(first >> 6) + 1] |= beyond;
  }
  [[nodiscard]] constexpr bool test(int x, int y) const {
    const auto bit = static_cast<unsigned>(y * kTileSize + x);
    return (words_[bit >> 6] >> (bit & 63u)) & 1u;
  }
  [[nodiscard]] constexpr bool test(int bit) const {
    return (words_[static_cast<unsigned>(bit) >> 6] >> (static_cast<unsigned>(bit) & 63u)) & 1u;
  }
  constexpr TexelMask& operator|=(const TexelMask& other) {
    for (std::size_t i = 0; i < words_.size(); ++i) words_[i] |= other.words_[i];
    return *this;
  }
  [[nodiscard]] constexpr bool contains(const TexelMask& other) const {
    for (std::size_t i = 0; i < words_.size(); ++i)
      if ((other.words_[i] & ~words_[i]) != 0) return false;
    return true;
  }
  [[nodiscard]] constexpr int count() const {
    int n = 0;
    for (const auto w : words_) n += std::popcount(w);
    return n;
  }
  [[nodiscard]] constexpr bool empty() const {
    for (const auto w : words_)
      if (w != 0) return false;
    return true;
  }
  [[nodiscard]] static constexpr TexelMask all() {
    TexelMask m;
    for (int bit = 0; bit < kTileTexels; ++bit)
      m.words_[static_cast<unsigned>(bit) >> 6] |= std::uint64_t{1} << (static_cast<unsigned>(bit) & 63u);
    return m;
  }
  constexpr bool operator==(const TexelMask&) const = default;

 private:
  std::array<std::uint64_t, 15> words_{};
};

}  // namespace darm
