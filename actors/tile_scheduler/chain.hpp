// What one picture sample can be drawn from: its tile at the sharp level and at up to three coarser ones.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>

#include "actors/tile_scheduler/dense_index.hpp"
#include "actors/types/tile_id.hpp"

namespace darm::tile_scheduler {

/// No tile: past the coarsest level. No real tile has this id (level 15 holds fewer than 2^28 - 1 tiles).
inline constexpr TileId kNoTile{0xffffffffu};
inline constexpr int kChainLength = kMaxCoarserLevels + 1;
/// Position "served by CoarseTex" in place of 0..3.
inline constexpr int kServedByCoarse = kChainLength;

/// tiles[0] is at the sharp level, tiles[i] at i levels coarser; kNoTile past the coarsest level.
struct Chain {
  std::array<TileId, kChainLength> tiles{kNoTile, kNoTile, kNoTile, kNoTile};
  bool operator==(const Chain&) const = default;
  [[nodiscard]] int sharp_level() const { return tiles[0].level(); }
};

/// A chain and the share of a view's samples that use it, 0..1.
struct WeightedChain {
  Chain chain;
  float weight = 0;
};

/// What a chain loses when served at position 0..3 or by CoarseTex, in any one unit.
using ChainLoss = std::array<float, kChainLength + 1>;

/// Steps of SampleTaps per texel.
inline constexpr std::uint32_t kTapSteps = 8;

/// Where one sample of a chain looks, in eighths of a texel: into the slot at each of its positions, and into CoarseTex
/// (at most 2048 a side).
struct SampleTaps {
  std::uint32_t chain = 0;  ///< its number in the set that holds both
  std::array<std::array<std::uint8_t, 2>, kChainLength> at{};
  std::array<std::uint16_t, 2> coarse{};

  /// `slot` is within [1, 31] but for rounding.
  void set(std::size_t position, glm::vec2 slot) {
    for (int axis = 0; axis < 2; ++axis) {
      const float eighths = slot[axis] * 8.0f + 0.5f;
      at[position][static_cast<std::size_t>(axis)] =
          static_cast<std::uint8_t>(eighths > 0 ? (eighths < 255.0f ? eighths : 255.0f) : 0.0f);
    }
  }
  [[nodiscard]] glm::vec2 position(std::size_t i) const { return glm::vec2(at[i][0], at[i][1]) * 0.125f; }
};

struct TileHash {
  std::size_t operator()(TileId id) const { return MixHash::mix(id.packed); }
};
struct ChainHash {
  std::size_t operator()(const Chain& c) const {
    const auto pair = [&](std::size_t i) {
      return (static_cast<std::uint64_t>(c.tiles[i].packed) << 32) | c.tiles[i + 1].packed;
    };
    return MixHash::mix(pair(0) * 0x9e3779b97f4a7c15ull ^ MixHash::mix(pair(2)));
  }
};

using TileIndex = DenseIndex<TileId, TileHash>;
using ChainIndex = DenseIndex<Chain, ChainHash>;

}  // namespace darm::tile_scheduler
