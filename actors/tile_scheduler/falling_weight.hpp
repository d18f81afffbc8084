// Tiles in the order of what they show.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "actors/types/tile_id.hpp"

namespace darm::tile_scheduler {

/// Sorts `numbers`, which name `tiles`, by falling `weight_of(number)`, and where that is equal by tile: the same order
/// on every run.
template <class WeightOf>
void sort_by_falling_weight(std::vector<std::uint32_t>& numbers, std::span<const TileId> tiles, WeightOf weight_of) {
  std::ranges::sort(numbers, [&](std::uint32_t a, std::uint32_t b) {
    const auto of_a = weight_of(a), of_b = weight_of(b);
    return of_a != of_b ? of_a > of_b : tiles[a] < tiles[b];
  });
}

}  // namespace darm::tile_scheduler
