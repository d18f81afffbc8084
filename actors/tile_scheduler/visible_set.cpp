#include "actors/tile_scheduler/visible_set.hpp"

#include <cmath>

namespace darm::tile_scheduler {

std::uint32_t VisibleSet::add(const Chain& chain, float count) {
  if (last_chain_ < counts_.size() && chains_.keys()[last_chain_] == chain) {
    counts_[last_chain_] += count;
    surface_samples_ += double{count};
    return last_chain_;
  }
  if (chains_.size() >= kMaxChains && chains_.find(chain) == ChainIndex::kAbsent) {
    ++left_out_;
    return kLeftOut;
  }
  const auto number = chains_.insert(chain);
  if (number == counts_.size()) counts_.push_back(0.0f);
  counts_[number] += count;
  surface_samples_ += double{count};
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

void VisibleSet::merge(const VisibleSet& other, float share, std::size_t most_taps) {
  std::vector<std::uint32_t> number(other.chains().size());
  for (std::size_t i = 0; i < other.chains().size(); ++i) number[i] = add(other.chains()[i], other.counts_[i] * share);
  for (auto taps : other.taps_) {
    if (taps_.size() >= most_taps) break;
    taps.chain = number[taps.chain];
    add_taps(taps);
  }
  for (std::size_t i = 0; i < other.tiles().size(); ++i) {
    auto* mine = use(other.tiles()[i]);
    if (mine == nullptr) continue;
    const auto& theirs = other.uses_[i];
    mine->kinds |= theirs.kinds;
    if (theirs.kinds & TileUse::kSharp) mine->sharp |= theirs.sharp;
    if (theirs.kinds & TileUse::kEarly) mine->early |= theirs.early;
    if (theirs.kinds & TileUse::kFallback) mine->fallback |= theirs.fallback;
    if (theirs.kinds & TileUse::kBorder) mine->border |= theirs.border;
  }
  samples_ += other.samples_ * double{share};
  magnified_ += other.magnified_ * double{share};
  omitted_ += other.omitted_ * double{share};
  diffuse_ += other.diffuse_ * double{share};
  left_out_ += other.left_out_;
}

void VisibleSet::reserve(std::size_t chains, std::size_t tiles) {
  chains_.reserve(chains);
  counts_.reserve(chains);
  tiles_.reserve(tiles);
  uses_.reserve(tiles);
}

void VisibleSet::forget_early() {
  for (auto& use : uses_) {
    use.early = TexelMask{};
    use.kinds &= static_cast<std::uint8_t>(~TileUse::kEarly);
  }
}

void VisibleSet::clear() { *this = VisibleSet{}; }

float VisibleSet::resolution_error() const {
  return surface_samples_ > 0 ? static_cast<float>(std::sqrt(magnified_ / surface_samples_)) : 0.0f;
}

float VisibleSet::omitted_error() const {
  return surface_samples_ > 0 ? static_cast<float>(std::sqrt(omitted_ / surface_samples_)) : 0.0f;
}

float VisibleSet::mean_diffuse() const {
  return surface_samples_ > 0 ? static_cast<float>(diffuse_ / surface_samples_) : 0.0f;
}

const TileUse* VisibleSet::find(TileId tile) const {
  const auto number = tiles_.find(tile);
  return number == TileIndex::kAbsent ? nullptr : &uses_[number];
}

}  // namespace darm::tile_scheduler
