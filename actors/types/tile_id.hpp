// A tile of the atlas, at one level, and the sizes every room agrees on.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace darm {

/// Payload of a tile, in texels per side: the stride of tiles in the atlas and in the radiance store.
inline constexpr int kTileSize = 30;
/// A slot of PhysTex: payload plus a border of one copied neighbour texel on each side.
inline constexpr int kSlotSize = 32;
inline constexpr int kTileTexels = kTileSize * kTileSize;
inline constexpr int kSlotTexels = kSlotSize * kSlotSize;
/// More levels than any scene needs: q=1024 over 16 levels ends at 32 units a texel.
inline constexpr int kMaxLevels = 16;
/// How many levels coarser than the sharp one a client looks before it takes CoarseTex.
inline constexpr int kMaxCoarserLevels = 3;

/// Tile `index` (= row * tiles_x + column) of `level` (0 is the finest). Packs into 32 bits: 4 + 28.
struct TileId {
  std::uint32_t packed = 0;

  constexpr TileId() = default;
  constexpr explicit TileId(std::uint32_t bits) : packed(bits) {}
  constexpr TileId(int level, std::uint32_t index)
      : packed((static_cast<std::uint32_t>(level) << 28) | (index & 0x0fffffffu)) {}

  [[nodiscard]] constexpr int level() const { return static_cast<int>(packed >> 28); }
  [[nodiscard]] constexpr std::uint32_t index() const { return packed & 0x0fffffffu; }
  constexpr auto operator<=>(const TileId&) const = default;
};

/// Largest number of tiles of one level that a TileId can name.
inline constexpr std::uint32_t kMaxTilesPerLevel = 1u << 28;

}  // namespace darm

template <>
struct std::hash<darm::TileId> {
  std::size_t operator()(const darm::TileId& id) const noexcept {
    return static_cast<std::size_t>(id.packed) * 0x9e3779b97f4a7c15ull >> 16;
  }
};
