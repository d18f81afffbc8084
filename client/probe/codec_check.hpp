// What the codec costs: the same tiles from a coded and from a lossless session, compared.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>

#include "client/core/page_table.hpp"
#include "client/core/video_decoder.hpp"

namespace darm::client::probe {

/// A slot as the codec sees it: 32x32 luma and two 16x16 chroma planes, full-range BT.709.
struct SlotPlanes {
  std::array<std::uint8_t, 1024> y;
  std::array<std::uint8_t, 256> cb, cr;
};

/// Page-table entry of a tile -> what its slot shows.
using TilePlanes = std::unordered_map<std::uint32_t, SlotPlanes>;

/// Tiles of a decoded 4:2:0 PhysTex; of a 4:4:4 one, chroma is averaged over 2x2.
[[nodiscard]] TilePlanes tiles_of(const Picture& phystex, const PageTable& pages, std::uint32_t entries);

/// Tiles of a lossless stream; `pixels`: slot -> 32 * 32 * 3 bytes of sRGB.
[[nodiscard]] TilePlanes tiles_of(const std::unordered_map<std::uint16_t, std::string>& pixels, const PageTable& pages,
                                  std::uint32_t entries);

struct CodecScore {
  double psnr = 0;  ///< dB over all Y, Cb and Cr samples
  std::uint64_t tiles = 0;
};

/// Over the tiles that both have; nothing if there is none. Light that went on converging between the two counts as an
/// error of the codec, so the figure is a lower bound.
[[nodiscard]] std::optional<CodecScore> compare_tiles(const TilePlanes& coded, const TilePlanes& lossless);

}  // namespace darm::client::probe
