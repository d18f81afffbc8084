// What is seen, as a sum of sets: of the present and of a moment ago, of one view or of many. Pure.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "actors/tile_scheduler/visible_set.hpp"

namespace darm::tile_scheduler {

/// One set and the weight of all its samples together. The set must outlive it.
struct SeenPart {
  const VisibleSet* set = nullptr;
  float weight = 1;
};

struct Seen {
  std::vector<SeenPart> parts;  ///< at least one; the first is the newest
  bool rests = false;           ///< it has been looked at closely
  [[nodiscard]] const VisibleSet& newest() const { return *parts.front().set; }
};

/// Distinct chains of all parts; weights are shares of the parts' samples. Those of the newest part come first, by its
/// numbers.
[[nodiscard]] std::vector<WeightedChain> chains_of(const Seen& seen);
/// Calls visit(tile, use) for each tile of each part (a tile may come more than once).
void for_each_use(const Seen& seen, const std::function<void(TileId, const TileUse&)>& visit);

}  // namespace darm::tile_scheduler
