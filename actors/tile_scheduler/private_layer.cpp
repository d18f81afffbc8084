#include "actors/tile_scheduler/private_layer.hpp"

#include <algorithm>
#include <utility>

namespace darm::tile_scheduler {
namespace {

// Chains of both poses, each once, with their worth as a share of the picture, and that share itself.
std::vector<WeightedChain> join(const PrivateSet& current, const PrivateSet& previous, float previous_weight,
                                std::vector<float>& shares) {
  std::vector<WeightedChain> out;
  ChainIndex seen;
  const auto append = [&](const PrivateSet& set, float weight) {
    if (set.samples() <= 0) return;
    const auto per_sample = static_cast<float>(double{weight} / set.samples());
    for (std::size_t i = 0; i < set.chains().size(); ++i) {
      const auto number = seen.insert(set.chains()[i]);
      if (number == out.size()) {
        out.push_back({set.chains()[i], 0.0f});
        shares.push_back(0.0f);
      }
      out[number].weight += set.worths()[i] * per_sample;
      shares[number] += set.counts()[i] * per_sample;
    }
  };
  append(current, 1.0f);
  append(previous, previous_weight);
  return out;
}

}  // namespace

PrivateLayer::PrivateLayer(const StreamFormat& format, const StreamOptions& stream, const PrivateLayerOptions& options)
    : options_(options),
      stream_(format, stream),
      // Twice the slots: what goes and comes again in a turn of the head need not be shaded first.
      images_(2 * slot_count(format) * (sizeof(TileImage) + 256)) {}

void PrivateLayer::start_pose(Microseconds now) {
  if (current_.samples() > 0) {
    previous_ = std::move(current_);
    moved_at_ = now;
  }
  current_.clear();
}

bool PrivateLayer::expire(Microseconds now) {
  if (previous_.samples() <= 0 || now - moved_at_ < options_.keep_previous) return false;
  previous_.clear();
  return true;
}

void PrivateLayer::reallocate(const AllocationOptions& options, int coarse_level) {
  allocation_ = options;
  coarse_level_ = coarse_level;
  chain_shares_.clear();
  chains_ = join(current_, previous_, options_.previous_weight, chain_shares_);
  losses_.assign(chains_.size(), options_.loss);
  target_ = allocate(nullptr);
  const auto share = shares();
  auto requests = std::make_shared<std::vector<renderer::ViewTileRequest>>();
  requests->reserve(target_.tiles.size());
  for (std::size_t i = 0; i < target_.tiles.size(); ++i) {
    renderer::ViewTileRequest r;
    r.tile = target_.tiles[i];
    r.share = share[i];
    for (const auto* set : {&current_, &previous_})
      if (const auto* mask = set->find(r.tile)) r.mask |= *mask;
    requests->push_back(r);
    images_.touch(r.tile);
  }
  requests_ = std::move(requests);
  grant();
}

Allocation PrivateLayer::allocate(const std::function<bool(TileId)>& available) const {
  const auto residents = stream_.table().residents();
  AllocationRequest request;
  request.chains = chains_;
  request.losses = losses_;
  request.residents = residents;
  request.available = available;
  request.slots = stream_.table().capacity();
  request.coarse_level = coarse_level_;
  request.exchange = false;
  return allocate_slots(request, allocation_);
}

// Share of the picture that each target tile serves.
std::vector<float> PrivateLayer::shares() const {
  TileIndex index;
  for (const auto tile : target_.tiles) index.insert(tile);
  std::vector<float> out(target_.tiles.size(), 0.0f);
  for (std::size_t c = 0; c < chains_.size(); ++c) {
    const auto position = target_.served[c];
    if (position >= kChainLength) continue;
    const auto number = index.find(chains_[c].chain.tiles[position]);
    if (number != TileIndex::kAbsent) out[number] += chain_shares_[c];
  }
  return out;
}

void PrivateLayer::grant() {
  const auto has = [this](TileId t) {
    const auto* image = images_.find(t);
    return image != nullptr && image->image != nullptr;
  };
  if (std::all_of(target_.tiles.begin(), target_.tiles.end(), has)) {
    granted_ = target_.tiles;
    return;
  }
  granted_ = allocate(has).tiles;
}

void PrivateLayer::put(const std::vector<ShadedTile>& tiles) {
  bool new_one = false;
  for (const auto& tile : tiles) {
    new_one = new_one || images_.find(tile.tile) == nullptr;
    images_.put(tile);
  }
  if (new_one) grant();
}

StreamStep PrivateLayer::step(Microseconds now, Microseconds least_interval) {
  return stream_.step(granted_, [this](TileId tile) { return images_.find(tile); }, 0.0f, now, least_interval);
}

}  // namespace darm::tile_scheduler
