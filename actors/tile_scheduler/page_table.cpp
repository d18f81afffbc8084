#include "actors/tile_scheduler/page_table.hpp"

#include <algorithm>
#include <utility>

namespace darm::tile_scheduler {

PageTable::PageTable(std::size_t slots) : slots_(std::clamp<std::size_t>(slots, 1, kNoSlot)) {
  free_.reserve(slots_.size());
  for (std::size_t i = slots_.size(); i-- > 0;) free_.push_back(static_cast<SlotIndex>(i));
  where_.reserve(slots_.size());
}

SlotIndex PageTable::slot_of(TileId tile) const {
  const auto it = where_.find(tile);
  return it == where_.end() ? kNoSlot : it->second;
}

std::optional<TileId> PageTable::tile_in(SlotIndex slot) const {
  return slot < slots_.size() ? slots_[slot].tile : std::nullopt;
}

std::vector<TileId> PageTable::residents() const {
  std::vector<TileId> out;
  out.reserve(where_.size());
  for (const auto& slot : slots_)
    if (slot.tile) out.push_back(*slot.tile);
  return out;
}

void PageTable::begin_frame(std::uint64_t frame, std::span<const TileId> needed) {
  frame_ = frame;
  for (const auto tile : needed) {
    const auto slot = slot_of(tile);
    if (slot == kNoSlot) continue;
    slots_[slot].needed = frame_;
    unlink(slot);
    link_newest(slot);
  }
}

SlotIndex PageTable::insert(TileId tile) {
  SlotIndex slot = slot_of(tile);
  if (slot != kNoSlot) {
    slots_[slot].needed = frame_;
    unlink(slot);
    link_newest(slot);
    return slot;
  }
  if (!free_.empty()) {
    slot = free_.back();
    free_.pop_back();
  } else {
    slot = oldest_;
    if (slots_[slot].needed == frame_) return kNoSlot;
    where_.erase(*slots_[slot].tile);
    edits_.push_back({*slots_[slot].tile, kNoSlot});
    unlink(slot);
  }
  slots_[slot].tile = tile;
  slots_[slot].needed = frame_;
  link_newest(slot);
  where_.emplace(tile, slot);
  edits_.push_back({tile, slot});
  return slot;
}

std::vector<TableEdit> PageTable::take_edits() { return std::exchange(edits_, {}); }

std::vector<TableEdit> PageTable::whole() const {
  std::vector<TableEdit> out;
  out.reserve(where_.size());
  for (std::size_t i = 0; i < slots_.size(); ++i)
    if (slots_[i].tile) out.push_back({*slots_[i].tile, static_cast<SlotIndex>(i)});
  return out;
}

void PageTable::unlink(SlotIndex slot) {
  auto& s = slots_[slot];
  (s.older == kNoSlot ? oldest_ : slots_[s.older].newer) = s.newer;
  (s.newer == kNoSlot ? newest_ : slots_[s.newer].older) = s.older;
  s.older = s.newer = kNoSlot;
}

void PageTable::link_newest(SlotIndex slot) {
  auto& s = slots_[slot];
  s.older = newest_;
  s.newer = kNoSlot;
  (newest_ == kNoSlot ? oldest_ : slots_[newest_].newer) = slot;
  newest_ = slot;
}

}  // namespace darm::tile_scheduler
