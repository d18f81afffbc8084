// What a session sees: the set of its present pose, growing pass by pass, and for a while what it saw before.
#pragma once

#include <cstdint>
#include <memory>

#include "actors/tile_scheduler/seen.hpp"
#include "actors/types/frame_stamps.hpp"

namespace darm::tile_scheduler {

struct WorkingSetOptions {
  Microseconds keep_previous = 500'000;  ///< how long what was seen before lives on
  float previous_weight = 0.25f;         ///< weight of a share of its samples, in 0..1
};

/// Accumulates the passes of one session's view. Bounded by VisibleSet's limits, three times. Those that adopt from
/// each other hold the same set, until one of them sees more.
class WorkingSet {
 public:
  explicit WorkingSet(WorkingSetOptions options = {});

  /// The camera moved: what follows belongs to a new pose. What was seen before is kept if `keep`: a pose that was
  /// looked at in whole passes alone, those that were only glanced at together. After `passes_per_picture` passes every
  /// pixel of the new pose will have been looked at (see visibility.hpp).
  void start_pose(Microseconds now, int passes_per_picture, bool keep = true);
  /// More samples of the present pose: `passes` whole passes are complete with them (0: part of a pass, or a glance).
  void add(VisibleSet samples, int passes);
  /// Takes over what another set knows of its present pose, which is this one's too: a new one here if `moved`.
  void adopt(const WorkingSet& other, bool moved, Microseconds now);
  /// Drops what was seen before when its time is over. True if it did.
  bool expire(Microseconds now);

  [[nodiscard]] int passes() const { return passes_; }
  [[nodiscard]] const VisibleSet& current() const { return *current_; }
  /// Present and before. Valid until the next change.
  [[nodiscard]] Seen seen() const;

 private:
  [[nodiscard]] bool alone() const { return current_.use_count() == 1; }
  VisibleSet& own();

  WorkingSetOptions options_;
  std::shared_ptr<VisibleSet> current_ = std::make_shared<VisibleSet>();  // never null; changed by its only holder
  VisibleSet previous_;  // the pose before; or what was glanced at since previous_at_,
  VisibleSet older_;     // and before that
  Microseconds moved_at_ = 0;
  Microseconds previous_at_ = 0;
  int passes_ = 0;
  int passes_per_picture_;
};

}  // namespace darm::tile_scheduler
