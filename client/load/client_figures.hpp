// What one client counts. Values alone.
#pragma once

#include <cstdint>
#include <vector>

#include "client/load/fault.hpp"

namespace darm::client::load {

struct ClientFigures {
  // Of the time that is counted.
  std::int64_t from_us = 0, to_us = 0;  ///< 0: not begun, not ended
  std::uint64_t answers = 0;            ///< messages that were the first to answer a camera
  std::uint64_t stream_frames = 0, view_frames = 0, no_changes = 0;
  std::uint64_t key_frames = 0, frames_dropped = 0;
  std::uint64_t bytes = 0;  ///< received over TCP
  std::uint64_t cameras = 0;
  std::vector<float> waits_ms;  ///< from each camera to its answer
  // Of its whole life.
  FaultCounts faults;
  std::int64_t begun_us = 0, welcomed_us = 0, first_frame_us = 0;  ///< 0: not yet
  std::int64_t stalled_until_us = 0;                               ///< when its line went on; 0: it never stood
  std::int64_t caught_up_us = 0;      ///< the first answer to a camera sent after that, 0: not yet
  std::int64_t fresh_picture_us = 0;  ///< the first frame since then
};

}  // namespace darm::client::load
