// How long tiles wait for a slot, in updates of their stream. Pure; one per stream.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "actors/tile_scheduler/page_table.hpp"

namespace darm::tile_scheduler {

class SlotWaits {
 public:
  /// One update of the stream: what it should have now, and what it has. Returns the waits that ended, in updates, of
  /// tiles that were not there when they were first wanted. Who is no longer wanted has not waited.
  [[nodiscard]] std::vector<std::uint32_t> update(std::span<const TileId> wanted, const PageTable& table);
  /// Tiles that wait now.
  [[nodiscard]] std::size_t waiting() const { return since_.size(); }

 private:
  std::unordered_map<TileId, std::uint64_t> since_;  // the update in which it was first wanted
  std::uint64_t updates_ = 0;
};

}  // namespace darm::tile_scheduler
