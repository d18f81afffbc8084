// Well-distributed random numbers that depend on nothing but (seed, pixel or texel, sample index, dimension).
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <glm/vec2.hpp>

namespace darm::renderer {

namespace detail {

/// Integer hash with full avalanche (constants of "lowbias32", C. Wellons).
[[nodiscard]] constexpr std::uint32_t mix_bits(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}

[[nodiscard]] constexpr std::uint32_t reverse_bits(std::uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  return __builtin_bswap32(x);
}

/// Laine-Karras permutation: a bit is changed only by lower bits, which on reversed bits is Owen scrambling.
[[nodiscard]] constexpr std::uint32_t permute_upwards(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

/// Second Sobol dimension (polynomial x + 1), a table per byte of the index.
inline constexpr auto kSobolTable = [] {
  std::array<std::array<std::uint32_t, 256>, 4> table{};
  std::uint32_t direction = 0x80000000u;
  for (std::size_t bit = 0; bit < 32; ++bit) {
    for (std::size_t byte = 0; byte < 256; ++byte)
      if ((byte >> (bit & 7u)) & 1u) table[bit >> 3][byte] ^= direction;
    direction ^= direction >> 1;
  }
  return table;
}();

[[nodiscard]] constexpr std::uint32_t sobol_second(std::uint32_t i) {
  return kSobolTable[0][i & 255u] ^ kSobolTable[1][(i >> 8) & 255u] ^ kSobolTable[2][(i >> 16) & 255u] ^
         kSobolTable[3][i >> 24];
}

/// [0, 1) from the upper 24 bits, so that the float never rounds up to 1.
[[nodiscard]] constexpr float to_unit(std::uint32_t x) { return static_cast<float>(x >> 8) * 0x1p-24f; }

}  // namespace detail

/// Counter-based: two samplers with equal arguments give equal numbers, whichever thread asks. Numbers lie in [0, 1).
/// The first kSobolDraws draws of the samples 0, 1, 2, ... of one pixel are Owen-scrambled Sobol points, padded pair by
/// pair (Burley, Practical Hash-based Owen Scrambling, JCGT 2020); later draws are hashes.
class Sampler {
 public:
  static constexpr std::uint32_t kSobolDraws = 32;

  Sampler(std::uint64_t seed, std::uint32_t pixel_or_texel_hash, std::uint32_t sample_index)
      : key_(detail::mix_bits(static_cast<std::uint32_t>(seed) ^
                              detail::mix_bits(static_cast<std::uint32_t>(seed >> 32) + 0x9e3779b9u) ^
                              detail::mix_bits(pixel_or_texel_hash + 0x68bc21ebu))),
        reversed_index_(detail::reverse_bits(sample_index)),
        index_(sample_index) {}

  [[nodiscard]] float next_1d() {
    const std::uint32_t draw = draw_++;
    const std::uint32_t key = detail::mix_bits(key_ + draw * 0x9e3779b9u);
    if (draw >= kSobolDraws) return detail::to_unit(detail::mix_bits(key ^ detail::mix_bits(index_ + 0x02e5be93u)));
    const std::uint32_t shuffled = detail::reverse_bits(detail::permute_upwards(reversed_index_, key));
    return detail::to_unit(
        detail::reverse_bits(detail::permute_upwards(shuffled, detail::mix_bits(key ^ 0x967a889bu))));
  }

  [[nodiscard]] glm::vec2 next_2d() {
    const std::uint32_t draw = draw_++;
    const std::uint32_t key = detail::mix_bits(key_ + draw * 0x9e3779b9u);
    if (draw >= kSobolDraws) {
      const std::uint32_t x = detail::mix_bits(key ^ detail::mix_bits(index_ + 0x02e5be93u));
      return {detail::to_unit(x), detail::to_unit(detail::mix_bits(x + 0x368cc8b7u))};
    }
    const std::uint32_t shuffled = detail::reverse_bits(detail::permute_upwards(reversed_index_, key));
    // The first Sobol dimension is the reversed index: two reversals cancel.
    const std::uint32_t x = detail::permute_upwards(shuffled, detail::mix_bits(key ^ 0x967a889bu));
    const std::uint32_t y = detail::permute_upwards(detail::reverse_bits(detail::sobol_second(shuffled)),
                                                    detail::mix_bits(key ^ 0xb5297a4du));
    return {detail::to_unit(detail::reverse_bits(x)), detail::to_unit(detail::reverse_bits(y))};
  }

  /// Leaves out one draw: the numbers that follow are the same as after taking it.
  void skip() { ++draw_; }

 private:
  std::uint32_t key_;
  std::uint32_t reversed_index_;
  std::uint32_t index_;
  std::uint32_t draw_ = 0;
};

/// A hash of two integers, for Sampler's pixel argument.
[[nodiscard]] constexpr std::uint32_t hash_pair(std::uint32_t a, std::uint32_t b) {
  return detail::mix_bits(a + 0x9e3779b9u * detail::mix_bits(b + 0x7f4a7c15u));
}

}  // namespace darm::renderer
