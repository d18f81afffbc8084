#include "actors/tile_scheduler/view_demand.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "actors/tile_scheduler/chain_loss.hpp"
#include "actors/tile_scheduler/coarseness.hpp"
#include "actors/tile_scheduler/falling_weight.hpp"
#include "actors/tile_scheduler/visibility.hpp"

namespace darm::tile_scheduler {
namespace {

using renderer::TileRequest;

constexpr float kMostlyLit = 0.8f;

// The target's tiles by number, with what the requests need of them.
struct Target {
  TileIndex tiles;
  std::vector<bool> as_fallback;  // serves some chain from a coarser level

  Target(const ViewDemand& demand) : as_fallback(demand.target.tiles.size(), false) {
    tiles.reserve(demand.target.tiles.size());
    for (const auto tile : demand.target.tiles) tiles.insert(tile);
    for (std::size_t c = 0; c < demand.chains.size(); ++c) {
      const auto position = demand.target.served[c];
      if (position == 0 || position >= kChainLength) continue;
      const auto number = tiles.find(demand.chains[c].chain.tiles[position]);
      if (number != TileIndex::kAbsent) as_fallback[number] = true;
    }
  }
};

// Largest weight among the target's tiles beside `tile`; 0 if there is none.
float weight_beside(const atlas::Layout& layout, const ViewDemand& demand, const Target& target, TileId tile) {
  const auto& level = layout.levels[static_cast<std::size_t>(tile.level())];
  const auto tx = static_cast<int>(tile.index() % level.tiles_x);
  const auto ty = static_cast<int>(tile.index() / level.tiles_x);
  float weight = 0;
  for (int y = std::max(0, ty - 1); y <= std::min(ty + 1, static_cast<int>(level.tiles_y) - 1); ++y)
    for (int x = std::max(0, tx - 1); x <= std::min(tx + 1, static_cast<int>(level.tiles_x) - 1); ++x) {
      const auto index = static_cast<std::uint32_t>(y) * level.tiles_x + static_cast<std::uint32_t>(x);
      const auto number = target.tiles.find(TileId(tile.level(), index));
      if (number != TileIndex::kAbsent) weight = std::max(weight, demand.target.weights[number]);
    }
  return weight;
}

}  // namespace

std::vector<TileRequest> requests_of(const Seen& seen, const atlas::Layout& layout, const ViewDemand& demand) {
  const Target target(demand);
  TileIndex requested;
  std::vector<TileRequest> out;
  const auto add = [&](TileId tile, const TexelMask& mask, float weight, bool display) {
    const auto number = requested.insert(tile);
    if (number == out.size()) {
      out.emplace_back();
      out.back().tile = tile;
      out.back().weight = weight;
      out.back().display = display;
    }
    out[number].mask |= mask;
  };
  for_each_use(seen, [&](TileId tile, const TileUse& use) {
    const auto number = target.tiles.find(tile);
    TexelMask mask = use.border;
    if (number != TileIndex::kAbsent) {
      mask |= use.sharp;
      mask |= use.early;
      if (target.as_fallback[number]) mask |= use.fallback;
      if (!mask.empty()) add(tile, mask, demand.target.weights[number], true);
    } else if (!mask.empty()) {
      const float weight = weight_beside(layout, demand, target, tile);
      if (weight > 0) add(tile, mask, weight, false);
    }
  });
  return out;
}

std::vector<TileId> sharp_tiles(std::span<const WeightedChain> chains) {
  TileIndex tiles;
  for (const auto& [chain, weight] : chains) tiles.insert(chain.tiles[0]);
  return tiles.keys();
}

std::vector<TileId> significant_tiles(std::span<const WeightedChain> chains, double share) {
  TileIndex tiles;
  std::vector<double> weights;
  double all = 0;
  for (const auto& [chain, weight] : chains) {
    const auto number = tiles.insert(chain.tiles[0]);
    if (number == weights.size()) weights.push_back(0);
    weights[number] += double(weight);
    all += double(weight);
  }
  std::vector<std::uint32_t> order(weights.size());
  std::iota(order.begin(), order.end(), 0u);
  sort_by_falling_weight(order, tiles.keys(), [&](std::uint32_t i) { return weights[i]; });
  std::vector<TileId> out;
  double sum = 0;
  for (const auto number : order) {
    if (sum >= share * all) break;
    sum += weights[number];
    out.push_back(tiles.keys()[number]);
  }
  return out;
}

std::vector<renderer::CoarseRequest> coarse_texels_seen(const VisibleSet& seen, const atlas::Layout& layout) {
  const auto& level = layout.levels.back();
  TileIndex tiles;
  std::vector<renderer::CoarseRequest> out;
  for (const auto& taps : seen.taps()) {
    const auto x = static_cast<int>(taps.coarse[0] / kTapSteps), y = static_cast<int>(taps.coarse[1] / kTapSteps);
    for (int v = std::max(0, y - 1); v <= std::min(y + 1, static_cast<int>(level.height) - 1); ++v)
      for (int u = std::max(0, x - 1); u <= std::min(x + 1, static_cast<int>(level.width) - 1); ++u) {
        const auto tile =
            static_cast<std::uint32_t>(v / kTileSize) * level.tiles_x + static_cast<std::uint32_t>(u / kTileSize);
        const auto number = tiles.insert(TileId(layout.coarse_level(), tile));
        if (number == out.size()) out.push_back({tile, {}});
        out[number].mask.set(u % kTileSize, v % kTileSize);
      }
  }
  return out;
}

ViewDemand demand_of(const Seen& seen, const atlas::Layout& layout, const PageTable& table, const ImageLookup& images,
                     const CoarseLuma* coarse, const AllocationOptions& options, Moves moves) {
  ViewDemand demand;
  demand.moves = moves;
  demand.chains = chains_of(seen);
  demand.crowded = sharp_tiles(demand.chains).size() > table.capacity();
  demand.rests = seen.rests;
  // The chains of the newest part come first, by the numbers that its taps use.
  if (demand.crowded)
    demand.losses = measure_losses(demand.chains, seen.newest().taps(), images, coarse, layout.coarse_level());
  const auto residents = table.residents();
  demand.target = allocate_slots({.chains = demand.chains,
                                  .residents = residents,
                                  .losses = demand.losses,
                                  .slots = table.capacity(),
                                  .coarse_level = layout.coarse_level(),
                                  .moves = moves,
                                  .exchange = demand.rests},
                                 options);
  grant_available(demand, layout.coarse_level(), table, images, options);
  demand.requests = requests_of(seen, layout, demand);
  if (coarse == nullptr) demand.coarse = coarse_texels_seen(seen.newest(), layout);
  return demand;
}

bool note_lit(ViewDemand& demand, const ImageLookup& images) {
  const auto& tiles = demand.target.tiles;
  double all = 0, lit = 0;
  bool complete = true;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const bool has = has_image(images, tiles[i]);
    complete = complete && has;
    all += double(demand.target.weights[i]);
    if (has) lit += double(demand.target.weights[i]);
  }
  demand.lit = all > 0 ? static_cast<float>(lit / all) : 0.0f;
  return complete;
}

void grant_available(ViewDemand& demand, int coarse_level, const PageTable& table, const ImageLookup& images,
                     const AllocationOptions& options) {
  if (note_lit(demand, images)) {
    demand.granted = demand.target;
    return;
  }
  // While most pictures are still to come, what there are change from one moment to the next.
  const bool begins = demand.lit < kMostlyLit;
  const auto residents = table.residents();
  demand.granted = allocate_slots({.chains = demand.chains,
                                   .residents = residents,
                                   .available = [&](TileId t) { return has_image(images, t); },
                                   .losses = demand.losses,
                                   .slots = table.capacity(),
                                   .coarse_level = coarse_level,
                                   .moves = begins ? Moves::kFreely : demand.moves,
                                   .exchange = false},  // for the time being only
                                  options);
}

ErrorOptions error_options(const ViewTone& tone) {
  constexpr float kEnough = 0.15f;  // as far from black and from white noise has all the room it takes
  ErrorOptions options;
  const float room = std::min({1.0f, tone.brightness / kEnough, tone.headroom / kEnough});
  options.coarse_tex = std::hypot(tone.coarse_light, std::sqrt(LossOptions{}.coarse_error) / 255.0f * room);
  options.variety = tone.variety;
  return options;
}

float view_error(std::span<const WeightedChain> chains, std::span<const std::uint8_t> served, const ImageLookup& images,
                 int coarse_level, bool has_coarse, const ErrorOptions& options) {
  const auto too_coarse = [&](int levels) {
    return double{error_of_coarser(static_cast<float>(levels))} * double{options.variety};
  };
  double sum = 0;
  double weight = 0;
  for (std::size_t c = 0; c < chains.size(); ++c) {
    const auto& [chain, share] = chains[c];
    const auto position = served[c];
    double squared = double(options.unlit) * double(options.unlit);
    if (position < kChainLength) {
      if (const auto* stored = images(chain.tiles[position]))
        squared = double(stored->error) * double(stored->error) + too_coarse(position) * too_coarse(position);
    } else if (has_coarse) {
      const double coarser = too_coarse(coarse_level - chain.sharp_level());
      squared = coarser * coarser + double{options.coarse_tex} * double{options.coarse_tex};
    }
    sum += double(share) * squared;
    weight += double(share);
  }
  return weight > 0 ? static_cast<float>(std::sqrt(sum / weight)) : options.unlit;
}

float view_error(const VisibleSet& view, const ChainIndex& known, const ViewDemand& demand, const ImageLookup& images,
                 int coarse_level, bool has_coarse, const ErrorOptions& options) {
  std::vector<WeightedChain> chains;
  std::vector<std::uint8_t> served;
  for (std::size_t c = 0; c < view.chains().size(); ++c) {
    const auto number = known.find(view.chains()[c]);
    chains.push_back({view.chains()[c], view.counts()[c]});
    served.push_back(number == ChainIndex::kAbsent ? std::uint8_t{kServedByCoarse} : demand.granted.served[number]);
  }
  return view_error(chains, served, images, coarse_level, has_coarse, options);
}

float known_share(const VisibleSet& view, const ChainIndex& known) {
  double all = 0, found = 0;
  for (std::size_t c = 0; c < view.chains().size(); ++c) {
    all += double(view.counts()[c]);
    if (known.find(view.chains()[c]) != ChainIndex::kAbsent) found += double(view.counts()[c]);
  }
  return all > 0 ? static_cast<float>(found / all) : 1.0f;
}

std::vector<TileRequest> join_requests(const std::vector<const std::vector<TileRequest>*>& views) {
  TileIndex index;
  std::vector<TileRequest> out;
  for (const auto* view : views)
    for (const auto& request : *view) {
      const auto number = index.insert(request.tile);
      if (number == out.size()) {
        out.push_back(request);
        continue;
      }
      out[number].weight += request.weight;
      out[number].display = out[number].display || request.display;
      out[number].target_error = std::min(out[number].target_error, request.target_error);
      out[number].mask |= request.mask;
    }
  return out;
}

}  // namespace darm::tile_scheduler
