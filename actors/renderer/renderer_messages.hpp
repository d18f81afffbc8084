// The renderer's inbox. Plain values only: peers may include this file and nothing else of the room.
#pragma once

#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "actors/runtime/overflow.hpp"
#include "actors/types/texel_mask.hpp"
#include "actors/types/tile_id.hpp"

namespace darm::renderer {

/// One tile that somebody sees. `weight` is the share of all sessions' pixels that read it, 0..1 summed over sessions.
/// `display`: an image of the tile is wanted; else its texels serve only as a neighbour's border.
struct TileRequest {
  TileId tile;
  float weight = 0;
  bool display = true;
  float target_error = 0;  ///< RMS display error under which it costs no more time; 0: never
  TexelMask mask;
};

/// Texels of a tile of the coarse level that somebody sees.
struct CoarseRequest {
  std::uint32_t tile = 0;  ///< index within the level
  TexelMask mask;
};

/// The whole working set, replacing the one before. What is not in it is not shaded.
struct ShadeTiles {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;
  std::shared_ptr<const std::vector<TileRequest>> work;
  std::uint64_t working_set = 0;      ///< increases with each message
  std::vector<CoarseRequest> coarse;  ///< what is seen of the coarse level; a tile may come more than once

  ShadeTiles(std::shared_ptr<const std::vector<TileRequest>> tiles, std::uint64_t number)
      : work(std::move(tiles)), working_set(number) {}
};

/// A slice of shading or of image making is done on the pool. The renderer sends it to itself.
struct SliceFinished {
  static constexpr auto kOverflow = runtime::Overflow::kReject;
  std::uint64_t slice = 0;
  explicit SliceFinished(std::uint64_t number) : slice(number) {}
};

using Inbox = std::variant<ShadeTiles, SliceFinished>;

}  // namespace darm::renderer
