#include "actors/tile_scheduler/slot_waits.hpp"

#include <algorithm>
#include <utility>

namespace darm::tile_scheduler {

std::vector<std::uint32_t> SlotWaits::update(std::span<const TileId> wanted, const PageTable& table) {
  ++updates_;
  std::vector<std::uint32_t> ended;
  std::unordered_map<TileId, std::uint64_t> still;
  for (const auto tile : wanted) {
    const auto before = since_.find(tile);
    if (table.slot_of(tile) == kNoSlot)
      still.emplace(tile, before == since_.end() ? updates_ : before->second);
    else if (before != since_.end())
      ended.push_back(static_cast<std::uint32_t>(std::min<std::uint64_t>(updates_ - before->second, 0xffffffffu)));
  }
  since_ = std::move(still);
  return ended;
}

}  // namespace darm::tile_scheduler
