#include "actors/tile_scheduler/stream_demand.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "actors/tile_scheduler/falling_weight.hpp"

namespace darm::tile_scheduler {
namespace {

// Numbers of tiles with summed weights, then as lists by falling weight.
class WeightedTiles {
 public:
  void add(TileId tile, float weight) {
    const auto number = tiles_.insert(tile);
    if (number == weights_.size()) weights_.push_back(0.0f);
    weights_[number] += weight;
  }
  void sorted(std::vector<TileId>& tiles, std::vector<float>& weights) const {
    std::vector<std::uint32_t> order(weights_.size());
    std::iota(order.begin(), order.end(), 0u);
    sort_by_falling_weight(order, tiles_.keys(), [&](std::uint32_t i) { return weights_[i]; });
    for (const auto number : order) {
      tiles.push_back(tiles_.keys()[number]);
      weights.push_back(weights_[number]);
    }
  }

 private:
  TileIndex tiles_;
  std::vector<float> weights_;
};

// What one view has of an allocation for all.
Allocation part_of(const Allocation& all, const ViewDemand& view, std::span<const std::uint32_t> number) {
  Allocation out;
  out.served.resize(view.chains.size());
  WeightedTiles tiles;
  for (std::size_t c = 0; c < view.chains.size(); ++c) {
    const auto position = all.served[number[c]];
    out.served[c] = position;
    const auto& [chain, weight] = view.chains[c];
    if (position < kChainLength && weight > 0) tiles.add(chain.tiles[position], weight);
  }
  tiles.sorted(out.tiles, out.weights);
  return out;
}

// Chains that no view has measured take the mean of those that are.
void fill_unmeasured(std::vector<ChainLoss>& losses, std::span<const float> measured) {
  std::array<double, kChainLength + 1> sum{};
  double all = 0;
  for (std::size_t c = 0; c < losses.size(); ++c) {
    if (!(measured[c] > 0)) continue;
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += double(losses[c][i]);
    all += double(measured[c]);
  }
  for (std::size_t c = 0; c < losses.size(); ++c)
    for (std::size_t i = 0; i < sum.size(); ++i)
      losses[c][i] = measured[c] > 0 ? losses[c][i] / measured[c] : static_cast<float>(sum[i] / std::max(all, 1e-12));
}

}  // namespace

JointView join_views(std::span<const ViewDemand* const> views) {
  JointView joint;
  ChainIndex index;
  std::vector<float> measured;  // weight of the views that measured each chain
  joint.rests = true;
  for (const auto* view : views) {
    auto& number = joint.number.emplace_back();
    number.reserve(view->chains.size());
    joint.rests = joint.rests && view->rests;
    const bool has_losses = view->losses.size() == view->chains.size();
    for (std::size_t c = 0; c < view->chains.size(); ++c) {
      const auto& [chain, weight] = view->chains[c];
      const auto n = index.insert(chain);
      if (n == joint.chains.size()) {
        joint.chains.push_back({chain, 0.0f});
        joint.losses.emplace_back();
        measured.push_back(0.0f);
      }
      joint.chains[n].weight += weight;
      number.push_back(n);
      if (!has_losses) continue;
      for (std::size_t i = 0; i < joint.losses[n].size(); ++i) joint.losses[n][i] += weight * view->losses[c][i];
      measured[n] += weight;
    }
  }
  if (std::ranges::none_of(measured, [](float w) { return w > 0; }))
    joint.losses.clear();
  else
    fill_unmeasured(joint.losses, measured);
  return joint;
}

void share_slots(std::span<ViewDemand* const> views, const JointView& joint, const PageTable& table,
                 const ImageLookup& images, int coarse_level, const AllocationOptions& options) {
  const auto residents = table.residents();
  const auto target = allocate_slots({.chains = joint.chains,
                                      .residents = residents,
                                      .losses = joint.losses,
                                      .slots = table.capacity(),
                                      .coarse_level = coarse_level,
                                      .exchange = joint.rests},
                                     options);
  for (std::size_t v = 0; v < views.size(); ++v) {
    views[v]->target = part_of(target, *views[v], joint.number[v]);
    views[v]->crowded = views[v]->joint = true;
  }
  share_available(views, joint, table, images, coarse_level, options);
}

void share_available(std::span<ViewDemand* const> views, const JointView& joint, const PageTable& table,
                     const ImageLookup& images, int coarse_level, const AllocationOptions& options) {
  bool complete = true;
  for (auto* view : views) complete = note_lit(*view, images) && complete;
  if (complete) {
    for (auto* view : views) view->granted = view->target;
    return;
  }
  const auto residents = table.residents();
  const auto granted = allocate_slots({.chains = joint.chains,
                                       .residents = residents,
                                       .available = [&](TileId t) { return has_image(images, t); },
                                       .losses = joint.losses,
                                       .slots = table.capacity(),
                                       .coarse_level = coarse_level,
                                       .exchange = false},  // for the time being only
                                      options);
  for (std::size_t v = 0; v < views.size(); ++v) views[v]->granted = part_of(granted, *views[v], joint.number[v]);
}

}  // namespace darm::tile_scheduler
