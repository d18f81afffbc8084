#include "actors/tile_scheduler/wanted_tiles.hpp"

#include "actors/tile_scheduler/falling_weight.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr std::size_t kLeastForgotten = 4096;

}  // namespace

void WantedTiles::add(const Allocation& granted) {
  changed_ = changed_ || !granted.tiles.empty();
  for (std::size_t i = 0; i < granted.tiles.size(); ++i) {
    const auto number = index_.insert(granted.tiles[i]);
    if (number == shares_.size()) shares_.emplace_back();
    auto& share = shares_[number];
    if (share.views++ == 0) ++wanted_;
    share.weight += granted.weights[i];
  }
}

void WantedTiles::remove(const Allocation& granted) {
  changed_ = changed_ || !granted.tiles.empty();
  for (std::size_t i = 0; i < granted.tiles.size(); ++i) {
    const auto number = index_.find(granted.tiles[i]);
    if (number == TileIndex::kAbsent || shares_[number].views == 0) continue;
    auto& share = shares_[number];
    share.weight -= granted.weights[i];
    if (--share.views > 0) continue;
    share.weight = 0;  // what rounding left
    --wanted_;
  }
  if (shares_.size() > kLeastForgotten && shares_.size() > 4 * wanted_) forget_unwanted();
}

void WantedTiles::forget_unwanted() {
  TileIndex index;
  std::vector<Share> shares;
  index.reserve(wanted_);
  for (std::size_t i = 0; i < shares_.size(); ++i) {
    if (shares_[i].views == 0) continue;
    index.insert(index_.keys()[i]);
    shares.push_back(shares_[i]);
  }
  index_ = std::move(index);
  shares_ = std::move(shares);
}

const std::vector<TileId>& WantedTiles::list(std::size_t slots) {
  if (!changed_) return list_;
  changed_ = false;
  std::vector<std::uint32_t> order;
  order.reserve(wanted_);
  for (std::uint32_t i = 0; i < shares_.size(); ++i)
    if (shares_[i].views > 0) order.push_back(i);
  sort_by_falling_weight(order, index_.keys(), [&](std::uint32_t i) { return shares_[i].weight; });
  if (order.size() > slots) order.resize(slots);
  list_.clear();
  for (const auto number : order) list_.push_back(index_.keys()[number]);
  return list_;
}

}  // namespace darm::tile_scheduler
