#include "actors/tile_scheduler/slot_waits.hpp"

#include <utility>

namespace darm::tile_scheduler {

std::vector<Microseconds> SlotWaits::update(std::span<const TileId> wanted, const PageTable& table, Microseconds now) {
  std::vector<Microseconds> ended;
  std::unordered_map<TileId, Microseconds> still;
  for (const auto tile : wanted) {
    const auto before = since_.find(tile);
    if (table.slot_of(tile) == kNoSlot)
      still.emplace(tile, before == since_.end() ? now : before->second);
    else if (before != since_.end())
      ended.push_back(now - before->second);
  }
  since_ = std::move(still);
  return ended;
}

}  // namespace darm::tile_scheduler
