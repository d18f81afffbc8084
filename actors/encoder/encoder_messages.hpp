// The encoder's inbox. Plain values only: peers may include this file and nothing else of the room.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "actors/runtime/overflow.hpp"
#include "actors/types/frame_stamps.hpp"
#include "actors/types/ids.hpp"
#include "actors/types/tile_id.hpp"
#include "actors/types/tile_image.hpp"

namespace darm::encoder {

/// A slot whose picture changes in this frame.
struct SlotWrite {
  SlotIndex slot = kNoSlot;
  std::shared_ptr<const TileImage> image;
};

/// One change of the page table: `tile` is now in `slot`, or absent (kNoSlot). With coverage where the tile has alpha.
struct PageEdit {
  TileId tile;
  SlotIndex slot = kNoSlot;
  std::shared_ptr<const CoverageTile> coverage;  ///< only with a slot, and only the first time; null: opaque
  std::shared_ptr<const ThroughTile> through;    ///< likewise; null: nothing in the tile is clear
};

/// Estimated RMS display error of one session's view.
struct ViewError {
  SessionId session{};
  float error = 0;
  float resolution = 0;  ///< ViewAnswer::resolution_error
  float omitted = 0;     ///< ViewAnswer::omitted_error
};

/// Make one frame. At most one per stream is under way: the scheduler waits for FrameDone.
struct ComposeFrame {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;
  FrameNumber frame = 0;
  bool key = false;  ///< IDR picture; `edits` then hold the whole page table
  std::vector<SlotWrite> writes;
  std::vector<PageEdit> edits;  ///< replaces the whole table when `key`
  std::vector<ViewAnswer> answers;
  float error = 0;                ///< estimated RMS display error of all views of the stream, 0..1
  std::vector<ViewError> errors;  ///< of each; a session that is not named has the stream's
  std::size_t most_bytes = 0;     ///< it should not be larger, at the cost of quality; 0: as large as quality asks for
  ComposeFrame(FrameNumber number, bool is_key) : frame(number), key(is_key) {}
};

/// The pool has encoded the frame (the encoder sends it to itself).
struct PictureEncoded {
  static constexpr auto kOverflow = runtime::Overflow::kReject;
  FrameNumber frame = 0;
  explicit PictureEncoded(FrameNumber number) : frame(number) {}
};

using Inbox = std::variant<ComposeFrame, PictureEncoded>;

/// The whole coarse level as a picture. Immutable; `rgb` is sRGB-encoded, interleaved, width * height * 3 bytes.
struct CoarsePicture {
  std::uint32_t version = 0;  ///< rises with every new picture
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> rgb;
};

/// There is a new picture of the coarse level: encode it and send it to every session.
struct CoarseShaded {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;
  std::shared_ptr<const CoarsePicture> picture;
  explicit CoarseShaded(std::shared_ptr<const CoarsePicture> p) : picture(std::move(p)) {}
};

/// A session has nothing of the coarse level yet.
struct CoarseWanted {
  static constexpr auto kOverflow = runtime::Overflow::kLatestByKey;
  SessionId session{};
  explicit CoarseWanted(SessionId id) : session(id) {}
  [[nodiscard]] std::uint64_t key() const { return static_cast<std::uint64_t>(session); }
};

/// The pool has encoded the coarse picture (the coarse encoder sends it to itself).
struct CoarseEncoded {
  static constexpr auto kOverflow = runtime::Overflow::kReject;
  std::uint32_t version = 0;
  explicit CoarseEncoded(std::uint32_t number) : version(number) {}
};

using CoarseInbox = std::variant<CoarseShaded, CoarseWanted, CoarseEncoded>;

}  // namespace darm::encoder
