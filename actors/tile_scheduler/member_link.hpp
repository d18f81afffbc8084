// The link of one session as the scheduler knows it: whether it keeps up with streams of those that do, whose streams
// it shares if not, when it has room for a frame and how large that may be. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "actors/tile_scheduler/tile_scheduler_messages.hpp"
#include "actors/types/frame_stamps.hpp"

namespace darm::tile_scheduler {

struct LinkOptions {
  Microseconds stands = 1'000'000;     ///< a link without room for so long does not keep up,
  double clearly_fast = 4;             ///< unless it is faster than it must be by this factor: then it will go on,
  Microseconds behind = 2'000'000;     ///< nor does a client that has lost pictures now and so long ago,
  double key_seconds = 1.5;            ///< nor a link that a key frame of a shared stream takes longer
  Microseconds slow_for = 500'000;     ///< (as it has been for this time, because measures err)
  Microseconds patience = 1'000'000;   ///< so long a stream of several slow members waits for one of them
  Microseconds keeps_up = 60'000'000;  ///< it comes back after so long without trouble; twice as long each time, up to
  int most_doublings = 4;              ///< so often,
  double room = 2;                     ///< and if it is faster than it must be by this factor
  Microseconds slower_after = 5'000'000;   ///< and goes to a slower lane when it would belong there for so long,
  Microseconds faster_after = 20'000'000;  ///< to a faster one for so long
  double key_budget = 0.6;                 ///< a key frame may take the link so many seconds
  double frame_budget = 0.3;               ///< another frame so many
  double share = 0.8;                      ///< of the link that frames may take: answers and geometry have the rest
  std::size_t least_bytes = 8'000;         ///< a frame may always be so large
  Microseconds longest = 2'000'000;        ///< a frame holds up the next for no longer, whatever the rate is said to be
};

/// How slow: 1 .. 5, the slowest first. Rate in bytes a second.
[[nodiscard]] std::uint8_t lane_of(double bytes_per_second);

/// `now` must not decrease.
class MemberLink {
 public:
  explicit MemberLink(const LinkOptions& options) : options_(options) {}

  void changed(LinkState state, double bytes_per_second, Microseconds now);
  /// Pictures were dropped because the client does not keep up.
  void lost_pictures(Microseconds now);
  /// A frame of so many bytes is on its way.
  void sent(std::size_t bytes, Microseconds now);
  /// Decides on its lane; to be called now and then. True if it is another. `key_bytes`: of streams of lane 0.
  bool settle(double key_bytes, Microseconds now);

  /// 0: it keeps up.
  [[nodiscard]] std::uint8_t lane() const { return lane_; }
  /// There is room for a frame.
  [[nodiscard]] bool ready(Microseconds now) const { return state_ == LinkState::kFree && now >= busy_until_; }
  /// If there is not, others of its stream should wait until there is.
  [[nodiscard]] bool worth_waiting_for(Microseconds now) const;
  /// That a frame may have; 0: any number.
  [[nodiscard]] std::size_t most_bytes(bool key) const;

 private:
  [[nodiscard]] bool keeps_up(double key_bytes, Microseconds now);
  [[nodiscard]] bool stands(Microseconds now) const { return full_since_ && now - *full_since_ >= options_.stands; }
  void choose_lane(Microseconds now);

  LinkOptions options_;
  LinkState state_ = LinkState::kFree;
  double rate_ = 0;
  std::uint8_t lane_ = 0;
  int doublings_ = 0;
  Microseconds busy_until_ = 0;
  Microseconds trouble_at_ = 0;  // it did not keep up
  std::optional<Microseconds> full_since_;
  std::optional<Microseconds> slow_since_;
  std::optional<Microseconds> lost_since_;  // pictures, for the first time since it is in its lane
  std::optional<Microseconds> lost_at_;
  std::optional<Microseconds> other_since_;  // its rate is of another lane
};

}  // namespace darm::tile_scheduler
