// How long tiles wait for a slot. Pure; one per stream.
#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include "actors/tile_scheduler/page_table.hpp"
#include "actors/types/frame_stamps.hpp"

namespace darm::tile_scheduler {

class SlotWaits {
 public:
  /// What the stream should have at `now` (which must not decrease), and what it has. Returns the waits that ended, of
  /// tiles that were not there when they were first wanted. Who is no longer wanted has not waited.
  [[nodiscard]] std::vector<Microseconds> update(std::span<const TileId> wanted, const PageTable& table,
                                                 Microseconds now);
  /// Tiles that wait now.
  [[nodiscard]] std::size_t waiting() const { return since_.size(); }

 private:
  std::unordered_map<TileId, Microseconds> since_;  // when it was first wanted
};

}  // namespace darm::tile_scheduler
