#include "actors/tile_scheduler/visible_set.hpp"

namespace darm::tile_scheduler {

void VisibleSet::add(const Chain& chain, float count) {
  if (chains_.size() >= kMaxChains && chains_.find(chain) == ChainIndex::kAbsent) {
    ++left_out_;
    return;
  }
  const auto number = chains_.insert(chain);
  if (number == counts_.size()) counts_.push_back(0.0f);
  counts_[number] += count;
}

TileUse* VisibleSet::use(TileId tile) {
  if (tile == last_tile_) return &uses_[last_index_];
  if (tiles_.size() >= kMaxTiles && tiles_.find(tile) == TileIndex::kAbsent) {
    ++left_out_;
    return nullptr;
  }
  const auto number = tiles_.insert(tile);
  if (number == uses_.size()) uses_.emplace_back();
  last_tile_ = tile;
  last_index_ = number;
  return &uses_[number];
}

void VisibleSet::merge(const VisibleSet& other) {
  for (std::size_t i = 0; i < other.chains().size(); ++i) add(other.chains()[i], other.counts_[i]);
  for (std::size_t i = 0; i < other.tiles().size(); ++i) {
    auto* mine = use(other.tiles()[i]);
    if (mine == nullptr) continue;
    const auto& theirs = other.uses_[i];
    mine->sharp |= theirs.sharp;
    mine->early |= theirs.early;
    mine->fallback |= theirs.fallback;
    mine->border |= theirs.border;
  }
  samples_ += other.samples_;
  left_out_ += other.left_out_;
}

void VisibleSet::forget_early() {
  for (auto& use : uses_) use.early = TexelMask{};
}

void VisibleSet::clear() { *this = VisibleSet{}; }

const TileUse* VisibleSet::find(TileId tile) const {
  const auto number = tiles_.find(tile);
  return number == TileIndex::kAbsent ? nullptr : &uses_[number];
}

}  // namespace darm::tile_scheduler
