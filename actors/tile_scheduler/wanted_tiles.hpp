// Tiles that the views of a stream have been granted, by how much they show of all. Kept up to date view by view.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "actors/tile_scheduler/slot_allocation.hpp"

namespace darm::tile_scheduler {

class WantedTiles {
 public:
  /// What one view has been granted.
  void add(const Allocation& granted);
  /// What was added before.
  void remove(const Allocation& granted);
  /// Those first that show most; at most `slots`.
  [[nodiscard]] const std::vector<TileId>& list(std::size_t slots);

 private:
  struct Share {
    std::uint32_t views = 0;
    float weight = 0;
  };
  void forget_unwanted();

  TileIndex index_;
  std::vector<Share> shares_;  // by number
  std::size_t wanted_ = 0;     // of shares_ with views
  std::vector<TileId> list_;
  bool changed_ = false;  // since the list was made
};

}  // namespace darm::tile_scheduler
