// What a stream has brought since somebody last looked: a value, so that it may cross threads.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "client/core/video_decoder.hpp"

namespace darm::client {

using SlotBytes = std::unordered_map<std::uint16_t, std::string>;

struct StreamNews {
  /// From a new player: what was shown of this stream before is void, but for CoarseTex.
  bool fresh = false;
  /// Changed rows of the page table's texture (kTableWidth slots each), by row.
  std::map<std::uint32_t, std::vector<std::uint16_t>> pages;
  std::shared_ptr<const Picture> picture;  ///< null: no newer one
  std::shared_ptr<const Picture> coarse;   ///< null: no newer one
  SlotBytes pixels;                        ///< lossless RGB of rewritten slots, 32 * 32 * 3 bytes
  SlotBytes coverage;                      ///< alpha of rewritten slots, 32 * 32 bytes
  SlotBytes through;                       ///< of a private layer: what clear surfaces pass, sRGB, 32 * 32 * 3 bytes

  [[nodiscard]] bool empty() const;
  /// `newer` follows on this: both together, as if they had come as one. Takes no more memory than the stream's
  /// textures, however many are added.
  void add(StreamNews newer);
};

}  // namespace darm::client
