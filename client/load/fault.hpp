// What may be wrong with what a server sends, and how often it was.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace darm::client::load {

enum class Fault : std::uint8_t {
  kMessage,           ///< no valid Envelope, or one that has no place there
  kManifest,          ///< contradicts itself, or names sizes over the limits
  kGeometry,          ///< a chunk that was not announced, or twice
  kCoarse,            ///< CoarseTex of another size, or no H.264 key frame
  kFrameOrder,        ///< a number is missing, and the frame is no key frame
  kStreamWithoutKey,  ///< another stream began, and not with a key frame
  kTile,              ///< an edit names a tile that the manifest does not have
  kSlot,              ///< an edit names a slot outside of PhysTex
  kTileTwice,         ///< a tile is given a slot while it has another
  kSlotTwice,         ///< after a frame a slot belongs to two tiles
  kTableDiffers,      ///< two clients have different tables after the same frame of one stream
  kNoPicture,         ///< a frame without H.264
  kWrongPicture,      ///< H.264 that does not begin as its frame must
  kUndecodable,       ///< H.264 that a decoder refuses
  kAnswerBackwards,   ///< an answer to an older camera than the answer before
  kAnswerUnsent,      ///< an answer to a camera that was not sent
  kError,             ///< an estimated error that is negative, infinite or no number
};
inline constexpr std::size_t kFaultKinds = static_cast<std::size_t>(Fault::kError) + 1;

/// As it stands in reports: lower case, one word or several with underscores.
[[nodiscard]] constexpr std::string_view to_string(Fault fault) {
  constexpr std::array<std::string_view, kFaultKinds> kNames = {
      "message",       "manifest",    "geometry",         "coarse",        "frame_order",   "stream_without_key",
      "tile",          "slot",        "tile_twice",       "slot_twice",    "table_differs", "no_picture",
      "wrong_picture", "undecodable", "answer_backwards", "answer_unsent", "error"};
  return kNames[static_cast<std::size_t>(fault)];
}

class FaultCounts {
 public:
  void add(Fault fault, std::uint64_t n = 1) { counts_[static_cast<std::size_t>(fault)] += n; }
  [[nodiscard]] std::uint64_t of(Fault fault) const { return counts_[static_cast<std::size_t>(fault)]; }
  [[nodiscard]] std::uint64_t total() const {
    std::uint64_t sum = 0;
    for (const auto n : counts_) sum += n;
    return sum;
  }
  FaultCounts& operator+=(const FaultCounts& other) {
    for (std::size_t i = 0; i < kFaultKinds; ++i) counts_[i] += other.counts_[i];
    return *this;
  }

 private:
  std::array<std::uint64_t, kFaultKinds> counts_{};
};

}  // namespace darm::client::load
