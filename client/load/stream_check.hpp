// Checks every frame of a stream against the protocol without decoding it. Pure.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "client/core/scene_model.hpp"
#include "client/core/stream_player.hpp"
#include "client/load/fault.hpp"
#include "proto/darm.pb.h"

namespace darm::client::load {

/// What became of one frame.
struct FrameNews {
  bool applied = false;       ///< the table is now that of this frame
  std::uint64_t dropped = 0;  ///< frames before it that never came; of a key frame that is no fault
};

/// Page table of one stream as a client keeps it: tiles, slots, order. A fault is counted and the frame applied as far
/// as it goes, so that one fault is not counted with every frame to come.
class StreamCheck {
 public:
  StreamCheck(std::shared_ptr<const SceneModel> scene, const StreamShape& shape);

  FrameNews take(const wire::StreamFrame& frame, FaultCounts& faults);

  /// A frame is missing: nothing is applied until the next key frame.
  [[nodiscard]] bool key_frame_wanted() const { return lost_; }
  [[nodiscard]] std::uint64_t frame_shown() const { return last_; }
  [[nodiscard]] std::uint64_t frames_lost() const { return frames_lost_; }
  /// Which stream it is, as its frames say; 0: they do not.
  [[nodiscard]] std::uint64_t stream() const { return stream_; }
  /// Equal for equal tables.
  [[nodiscard]] std::uint64_t table() const { return table_hash_; }
  [[nodiscard]] std::uint32_t residents() const { return residents_; }

 private:
  [[nodiscard]] bool in_order(const wire::StreamFrame& frame, FaultCounts& faults, FrameNews& news);
  void check_picture(const wire::StreamFrame& frame, FaultCounts& faults) const;
  void apply_edits(const wire::StreamFrame& frame, FaultCounts& faults);
  void place(std::uint32_t entry, std::uint16_t slot, FaultCounts& faults);
  void set(std::uint32_t entry, std::uint16_t slot);
  void clear();

  std::shared_ptr<const SceneModel> scene_;
  StreamShape shape_;
  std::vector<std::uint16_t> slot_of_;    // by page-table entry
  std::vector<std::uint32_t> holder_;     // by slot: entry, or kNobody
  std::vector<std::uint32_t> displaced_;  // entries that lost their slot to another in this frame
  std::uint64_t table_hash_ = 0;
  std::uint32_t residents_ = 0;
  std::uint64_t stream_ = 0;
  std::uint64_t last_ = 0;
  std::uint64_t frames_lost_ = 0;
  bool begun_ = false;
  bool lost_ = false;
};

}  // namespace darm::client::load
