#include "actors/tile_scheduler/seen.hpp"

namespace darm::tile_scheduler {

std::vector<WeightedChain> chains_of(const Seen& seen) {
  std::vector<WeightedChain> out;
  ChainIndex index;
  for (std::size_t p = 0; p < seen.parts.size(); ++p) {
    const auto& [set, weight] = seen.parts[p];
    if (set->samples() <= 0) continue;
    const auto per_sample = static_cast<float>(double{weight} / set->samples());
    const auto& chains = set->chains();
    if (p == 0) {
      out.reserve(chains.size());
      for (std::size_t i = 0; i < chains.size(); ++i) out.push_back({chains[i], set->counts()[i] * per_sample});
      if (seen.parts.size() > 1) index = set->chain_index();
      continue;
    }
    for (std::size_t i = 0; i < chains.size(); ++i) {
      const auto number = index.insert(chains[i]);
      if (number == out.size()) out.push_back({chains[i], 0.0f});
      out[number].weight += set->counts()[i] * per_sample;
    }
  }
  return out;
}

void for_each_use(const Seen& seen, const std::function<void(TileId, const TileUse&)>& visit) {
  for (const auto& part : seen.parts)
    for (std::size_t i = 0; i < part.set->tiles().size(); ++i) visit(part.set->tiles()[i], part.set->uses()[i]);
}

}  // namespace darm::tile_scheduler
