#include "actors/tile_scheduler/private_layer.hpp"

#include <algorithm>
#include <utility>

namespace darm::tile_scheduler {
namespace {

// Chains of both poses, each once, with their worth as a share of the picture.
struct Joined {
  std::vector<WeightedChain> chains;
  std::vector<float> shares;   // of the picture, parallel
  std::vector<float> squares;  // of errors of lacking it, times that
  ChainIndex seen;

  void append(const PrivateSet& set, float weight) {
    if (set.samples() <= 0) return;
    const auto per_sample = static_cast<float>(double{weight} / set.samples());
    for (std::size_t i = 0; i < set.chains().size(); ++i) {
      const auto number = seen.insert(set.chains()[i]);
      if (number == chains.size()) {
        chains.push_back({set.chains()[i], 0.0f});
        shares.push_back(0.0f);
        squares.push_back(0.0f);
      }
      chains[number].weight += set.worths()[i] * per_sample;
      shares[number] += set.counts()[i] * per_sample;
      squares[number] += set.squares()[i] * per_sample;
    }
  }
};

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
  Joined joined;
  joined.append(current_, 1.0f);
  joined.append(previous_, options_.previous_weight);
  chains_ = std::move(joined.chains);
  chain_shares_ = std::move(joined.shares);
  chain_squares_ = std::move(joined.squares);
  share_sum_ = 1.0 + (previous_.samples() > 0 ? double{options_.previous_weight} : 0.0);
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
    granted_ = target_;
    return;
  }
  granted_ = allocate(has);
}

double PrivateLayer::squared_error(float shown) const {
  double sum = 0;
  for (std::size_t c = 0; c < chains_.size() && c < granted_.served.size(); ++c) {
    const auto position = granted_.served[c];
    const auto* stored = position < kChainLength ? images_.find(chains_[c].chain.tiles[position]) : nullptr;
    const double lost =
        double{options_.loss[stored != nullptr ? position : std::size_t{kServedByCoarse}]} * double{shown};
    const double noise = stored != nullptr ? double{stored->error} : 0.0;
    sum += double{chain_squares_[c]} * lost * lost + double{chain_shares_[c]} * noise * noise;
  }
  return sum / share_sum_;
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
  return stream_.step(granted_.tiles, [this](TileId tile) { return images_.find(tile); }, 0.0f, now, least_interval);
}

}  // namespace darm::tile_scheduler
