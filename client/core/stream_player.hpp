// Turns stream messages into what is to be drawn: the page table, PhysTex and CoarseTex. Pure but for the video
// decoder.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/core/page_table.hpp"
#include "client/core/picture_pool.hpp"
#include "client/core/result.hpp"
#include "client/core/scene_model.hpp"
#include "client/core/stream_news.hpp"
#include "client/core/video_decoder.hpp"
#include "proto/darm.pb.h"

namespace darm::client {

/// What Welcome settled about the stream.
struct StreamShape {
  std::uint32_t phystex_size = 2048;  ///< pixels, square, a multiple of 32, at most 16384
  bool chroma_444 = false;
  bool lossless = false;
  [[nodiscard]] std::uint32_t slots_per_row() const { return phystex_size / kSlotSize; }
  /// 65535 is the name of "absent", so a larger PhysTex leaves its last slots unused.
  [[nodiscard]] std::uint32_t slot_count() const { return std::min(slots_per_row() * slots_per_row(), 65535u); }
};

/// What became of a StreamFrame.
enum class FrameFate : std::uint8_t {
  kApplied,  ///< picture and page table are now those of this frame
  kSkipped,  ///< not applied: waiting for a key frame (ask for one while key_frame_wanted())
};

/// Keeps picture and page table of one stream in step: both of a frame, or neither (DESIGN section 4 "Frames").
/// A gap in the frame numbers or a picture that does not decode skips frames until the next key frame; a message that
/// contradicts the manifest (slot, tile or size out of range) is an error: the server is not to be trusted. The server
/// may go over to another of its streams: with a key frame, which replaces what there was; until it is there the
/// picture stays.
class StreamPlayer {
 public:
  [[nodiscard]] static Result<StreamPlayer> create(const SceneModel& scene, const StreamShape& shape);

  [[nodiscard]] Result<FrameFate> apply(const wire::StreamFrame& frame, const SceneModel& scene);
  [[nodiscard]] Result<void> apply(const wire::CoarseTexture& coarse, const SceneModel& scene);

  [[nodiscard]] bool key_frame_wanted() const { return key_wanted_; }
  [[nodiscard]] std::uint64_t frame_shown() const { return last_frame_; }
  [[nodiscard]] std::uint64_t frames_lost() const { return frames_lost_; }
  [[nodiscard]] const StreamShape& shape() const { return shape_; }
  [[nodiscard]] PageTable& pages() { return pages_; }
  [[nodiscard]] const PageTable& pages() const { return pages_; }

  /// The picture shown now; of a coded stream, once a frame was applied.
  [[nodiscard]] const Picture& picture() const { return *picture_; }
  [[nodiscard]] bool has_coarse() const { return has_coarse_; }
  /// What came since the last call. Of the frames nothing before the first was applied: until then whoever shows the
  /// stream keeps what it has, be it of an earlier session.
  [[nodiscard]] StreamNews take_news();

 private:
  struct Edit {
    std::uint32_t entry;
    std::uint16_t slot;
    std::string coverage;  // inflated; empty: opaque
    std::string through;   // inflated; empty: nothing clear
  };
  StreamPlayer(VideoDecoder decoder, VideoDecoder still_decoder, const SceneModel& scene, const StreamShape& shape);
  [[nodiscard]] Result<std::vector<Edit>> read_edits(const wire::StreamFrame& frame, const SceneModel& scene) const;
  [[nodiscard]] Result<void> check_pixels(const wire::StreamFrame& frame) const;
  void commit(const wire::StreamFrame& frame, std::vector<Edit> edits);
  void lose_track();

  VideoDecoder decoder_;
  VideoDecoder still_decoder_;
  StreamShape shape_;
  PageTable pages_;
  std::vector<std::uint32_t> slot_tile_;  // whose coverage lies in the slot
  std::vector<bool> slot_masked_;         // the slot's coverage is not all 255
  std::vector<bool> slot_clear_;          // the slot's share of what is behind is not all 0
  PicturePool pool_;
  std::shared_ptr<const Picture> picture_ = std::make_shared<Picture>();
  StreamNews news_;
  std::uint64_t last_frame_ = 0;
  std::uint64_t stream_ = 0;  // of that frame
  std::uint64_t frames_lost_ = 0;
  bool key_wanted_ = true;
  bool begun_ = false;  // a frame was applied
  bool has_coarse_ = false;
};

}  // namespace darm::client
