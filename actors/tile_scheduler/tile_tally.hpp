// How many of a group want each tile. Kept up to date as sets come and go, so that a union costs nothing to ask for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "actors/tile_scheduler/chain.hpp"

namespace darm::tile_scheduler {

class TileTally {
 public:
  /// One more set of distinct tiles.
  void add(std::span<const TileId> set) {
    for (const auto tile : set) {
      const auto number = index_.insert(tile);
      if (number == counts_.size()) counts_.push_back(0);
      if (counts_[number]++ == 0) ++distinct_;
    }
  }
  /// A set that was added before goes.
  void remove(std::span<const TileId> set) {
    for (const auto tile : set) {
      const auto number = index_.find(tile);
      if (number == TileIndex::kAbsent || counts_[number] == 0) continue;
      if (--counts_[number] == 0) --distinct_;
    }
    if (counts_.size() > kLeastForgotten && counts_.size() > 4 * distinct_) forget_unwanted();
  }

  /// Tiles that somebody wants.
  [[nodiscard]] std::size_t distinct() const { return distinct_; }
  [[nodiscard]] std::uint32_t count(TileId tile) const {
    const auto number = index_.find(tile);
    return number == TileIndex::kAbsent ? 0 : counts_[number];
  }
  /// How many of `set` nobody wants yet.
  [[nodiscard]] std::size_t missing(std::span<const TileId> set) const {
    std::size_t out = 0;
    for (const auto tile : set) out += count(tile) == 0 ? 1 : 0;
    return out;
  }
  /// In order of first mention.
  [[nodiscard]] std::vector<TileId> tiles() const {
    std::vector<TileId> out;
    out.reserve(distinct_);
    for (std::size_t i = 0; i < counts_.size(); ++i)
      if (counts_[i] > 0) out.push_back(index_.keys()[i]);
    return out;
  }

 private:
  static constexpr std::size_t kLeastForgotten = 4096;

  // A walk through a large scene leaves tiles behind.
  void forget_unwanted() {
    TileIndex index;
    std::vector<std::uint32_t> counts;
    index.reserve(distinct_);
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      if (counts_[i] == 0) continue;
      index.insert(index_.keys()[i]);
      counts.push_back(counts_[i]);
    }
    index_ = std::move(index);
    counts_ = std::move(counts);
  }

  TileIndex index_;
  std::vector<std::uint32_t> counts_;  // by number
  std::size_t distinct_ = 0;
};

}  // namespace darm::tile_scheduler
