// What a session needs: the set of its present pose, growing pass by pass, and for a while that of the pose before.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "actors/tile_scheduler/visible_set.hpp"
#include "actors/types/frame_stamps.hpp"

namespace darm::tile_scheduler {

struct WorkingSetOptions {
  Microseconds keep_previous = 500'000;  ///< how long the previous pose's set lives on
  float previous_weight = 0.25f;         ///< weight of a share of the previous pose's samples, in 0..1
};

/// Accumulates the passes of one session's view. Bounded by VisibleSet's limits, twice.
class WorkingSet {
 public:
  explicit WorkingSet(WorkingSetOptions options = {});

  /// The camera moved: what follows belongs to a new pose. The old set is kept if it has samples. After
  /// `passes_per_picture` passes every pixel of the new one will have been looked at (see visibility.hpp).
  void start_pose(Microseconds now, int passes_per_picture);
  /// More samples of the present pose: `passes` whole passes are complete with them (0: part of a pass).
  void add(const VisibleSet& samples, int passes);
  /// Takes over what another set knows of its present pose, which is this one's too: a new one here if `moved`.
  void adopt(const WorkingSet& other, bool moved, Microseconds now);
  /// Drops the previous pose's set when its time is over. True if it did.
  bool expire(Microseconds now);

  [[nodiscard]] int passes() const { return passes_; }
  [[nodiscard]] const VisibleSet& current() const { return current_; }
  /// Distinct chains of both poses; weights are shares of the view's samples.
  [[nodiscard]] std::vector<WeightedChain> chains() const;
  /// Calls visit(tile, use) for each tile of the present and then of the previous pose (a tile may come twice).
  void for_each_use(const std::function<void(TileId, const TileUse&)>& visit) const;

 private:
  WorkingSetOptions options_;
  VisibleSet current_;
  VisibleSet previous_;
  Microseconds moved_at_ = 0;
  int passes_ = 0;
  int passes_per_picture_;
};

}  // namespace darm::tile_scheduler
