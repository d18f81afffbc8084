#include "actors/tile_scheduler/visible_set.hpp"

namespace darm::tile_scheduler {

std::uint32_t VisibleSet::add(const Chain& chain, float count) {
  if (last_chain_ < counts_.size() && chains_.keys()[last_chain_] == chain) {
    counts_[last_chain_] += count;
    return last_chain_;
  }
  if (chains_.size() >= kMaxChains && chains_.find(chain) == ChainIndex::kAbsent) {
    ++left_out_;
    return kLeftOut;
  }
  const auto number = chains_.insert(chain);
  if (number == counts_.size()) counts_.push_back(0.0f);
  counts_[number] += count;
  return last_chain_ = number;
}

void VisibleSet::add_taps(const SampleTaps& taps) {
  if (taps_.size() < kMaxTaps && taps.chain < counts_.size()) taps_.push_back(taps);
}

TileUse* VisibleSet::use(TileId tile) {
  const auto level = static_cast<std::size_t>(tile.level());
  if (tile == last_tile_[level]) return &uses_[last_index_[level]];
  if (tiles_.size() >= kMaxTiles && tiles_.find(tile) == TileIndex::kAbsent) {
    ++left_out_;
    return nullptr;
  }
  const auto number = tiles_.insert(tile);
  if (number == uses_.size()) uses_.emplace_back();
  last_tile_[level] = tile;
  last_index_[level] = number;
  return &uses_[number];
}

void VisibleSet::merge(const VisibleSet& other) {
  std::vector<std::uint32_t> number(other.chains().size());
  for (std::size_t i = 0; i < other.chains().size(); ++i) number[i] = add(other.chains()[i], other.counts_[i]);
  for (auto taps : other.taps_) {
    taps.chain = number[taps.chain];
    add_taps(taps);
  }
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
