// One video stream as the scheduler knows it: its slots, what was sent of them, and what the next frame holds. Pure.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "actors/encoder/encoder_messages.hpp"
#include "actors/tile_scheduler/page_table.hpp"
#include "actors/tile_scheduler/tile_scheduler_messages.hpp"
#include "actors/types/frame_stamps.hpp"
#include "actors/types/tile_image.hpp"

namespace darm::tile_scheduler {

/// Newest picture of a tile.
struct StoredImage {
  std::uint32_t version = 0;
  float error = 0;
  std::shared_ptr<const TileImage> image;
};
/// Null: the tile has no picture yet. The pointer is used before the next call only.
using ImageLookup = std::function<const StoredImage*(TileId)>;
[[nodiscard]] inline bool has_image(const ImageLookup& images, TileId tile) {
  const auto* stored = images(tile);
  return stored != nullptr && stored->image != nullptr;
}

struct StreamOptions {
  std::size_t max_writes = 2048;  ///< slots written per frame, key frames excepted; at least 1
  /// Least time between frames that only refine what is shown: encoding one costs the same whether it holds one tile or
  /// a hundred, and that time is taken from shading. Frames with new tiles never wait.
  Microseconds refine_interval = 0;
  /// Least time until a frame without any change, which the codec uses to come nearer to the same picture.
  Microseconds polish_interval = 800'000;
};

/// Slots of a PhysTex; at most 65535, because slots are named by 16 bits and one value means none.
[[nodiscard]] std::size_t slot_count(const StreamFormat& format);

/// What to do now for a stream.
struct StreamStep {
  std::optional<encoder::ComposeFrame> frame;  ///< to the encoder
  std::vector<ViewAnswer> no_change;           ///< to these sessions: looked at, nothing to send now
};

class StreamState {
 public:
  StreamState(const StreamFormat& format, StreamOptions options);

  void want_key() { key_pending_ = true; }
  /// The working set now includes this view; the next frame or NoChange answers it (once).
  void view_ready(const ViewAnswer& answer);
  /// The session goes. What it has not been answered for certain, if anything.
  std::optional<ViewAnswer> forget_session(SessionId session);

  /// Decides on the next frame. `wanted`: tiles the sessions should have, most important first, at most as many as
  /// slots; only those with an image enter. Nothing happens while a frame is in flight. Until `least_interval` after
  /// the last frame there is none but a key frame; cameras are answered without.
  [[nodiscard]] StreamStep step(std::span<const TileId> wanted, const ImageLookup& images, float error,
                                Microseconds now, Microseconds least_interval = 0);
  /// The encoder is done with frame `number`. A failed frame makes the next one a key frame and is answered again. Not
  /// `settled`: coded again, the same picture would be finer, so a frame follows even if nothing changes.
  void frame_done(FrameNumber number, bool ok, bool settled = true);
  /// The encoder is gone, and the frame in flight with it. However long one takes is no sign of that.
  void encoder_gone() { frame_done(in_flight_, false); }

  [[nodiscard]] const PageTable& table() const { return table_; }
  [[nodiscard]] bool in_flight() const { return in_flight_ != 0; }
  /// The next frame is a key frame.
  [[nodiscard]] bool key_pending() const { return key_pending_; }
  /// The frame in flight answers a camera of this session.
  [[nodiscard]] bool answers_in_flight(SessionId session) const;
  [[nodiscard]] bool has_answers() const { return !answers_.empty(); }
  [[nodiscard]] FrameNumber last_frame() const { return last_frame_; }

 private:
  [[nodiscard]] bool has_news(std::span<const TileId> wanted, const ImageLookup& images, Microseconds now) const;
  [[nodiscard]] std::vector<ViewAnswer> take_answers();
  [[nodiscard]] bool polish_due(Microseconds now) const;
  [[nodiscard]] bool refine_due(Microseconds now) const { return now - sent_at_ >= options_.refine_interval; }
  void write_slot(encoder::ComposeFrame& frame, SlotIndex slot, const StoredImage& image);
  void enter_new(encoder::ComposeFrame& frame, std::span<const TileId> wanted, const ImageLookup& images);
  void refine(encoder::ComposeFrame& frame, std::span<const TileId> wanted, const ImageLookup& images);
  void write_all(encoder::ComposeFrame& frame, const ImageLookup& images);
  [[nodiscard]] encoder::PageEdit edit_of(const TableEdit& edit) const;

  struct Sent {
    std::uint32_t version = 0;
    std::shared_ptr<const TileImage> image;  // kept: a key frame must be able to repeat it
  };

  StreamOptions options_;
  PageTable table_;
  std::vector<Sent> sent_;  // per slot
  std::map<SessionId, ViewAnswer> answers_;
  std::vector<ViewAnswer> answers_in_flight_;
  FrameNumber last_frame_ = 0;
  FrameNumber in_flight_ = 0;  // 0: none
  Microseconds sent_at_ = 0;
  bool key_pending_ = true;
  bool settled_ = true;
};

}  // namespace darm::tile_scheduler
