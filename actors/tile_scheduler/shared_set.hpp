// What the members of a stream see, together. Pure.
#pragma once

#include <span>
#include <vector>

#include "actors/tile_scheduler/seen.hpp"
#include "actors/tile_scheduler/tile_scheduler_messages.hpp"
#include "actors/types/frame_stamps.hpp"

namespace darm::tile_scheduler {

/// What one member sees, for the shared set.
struct MemberLook {
  const ViewChanged* view = nullptr;  ///< the camera that it was seen from; null: one of its own
  const VisibleSet* samples = nullptr;
  float looks = 1;  ///< see SharedSet::add()
};
/// Those of the very same view as one: what the one that knows most has seen, for the looks of all of them. A hundred
/// who stand at one place (a page's first view) see the same thing a hundred times. In the order they came.
[[nodiscard]] std::vector<MemberLook> join_same_views(std::span<const MemberLook> looks);

/// Gathers what each member's looks bring, for about `keep`: few rays a look are enough where many look around. Each
/// look of each member counts alike, whatever its size, so that no client buys more of a stream with a larger picture.
/// Bounded by VisibleSet's limits, twice.
class SharedSet {
 public:
  static constexpr Microseconds kKeep = 1'000'000;
  static constexpr Microseconds kLongestKeep = 5'000'000;
  /// What a look weighs that stands for a second of them, of a member that rests.
  static constexpr float kRests = 10;
  /// A hundred thousand would be measured in ten milliseconds; a few for each chain are enough.
  static constexpr std::size_t kMaxTaps = 65536;

  /// What a look has brought, of one view.
  void add(const VisibleSet& samples, float looks = 1);
  /// Somebody sees something else than before, or has gone.
  void note_change() { changed_ = true; }
  /// What is gathered holds things that nobody may see any more.
  [[nodiscard]] bool stale(Microseconds now) const { return (changed_ || older_.samples() > 0) && now >= renew_at_; }
  /// Sets apart what was gathered until now and forgets what was before. What members see now is to be added again. Not
  /// stale again for kKeep, or ten times as long as renewing took (see renewed()), kLongestKeep at most.
  void renew(Microseconds now);
  /// That took so much processor time.
  void renewed(Microseconds took, Microseconds now);
  void clear() { *this = SharedSet{}; }

  /// Valid until the next change.
  [[nodiscard]] Seen seen(bool rests) const;

 private:
  VisibleSet newest_;  // samples() are looks
  VisibleSet older_;
  bool changed_ = false;
  Microseconds renew_at_ = 0;
};

}  // namespace darm::tile_scheduler
