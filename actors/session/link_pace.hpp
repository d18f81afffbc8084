// What the link of one session carries, and whether it has room for another picture. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "actors/types/frame_stamps.hpp"

namespace darm::session {

/// Pings travel behind what is sent, in order; a pong says that all before its ping has arrived. What the kernel has
/// taken says less: buffers here, on the way and of a relay hold a second and more of a slow line. A link that is known
/// to be fast is pinged every few seconds only. No clock inside: `now` must not decrease.
class LinkPace {
 public:
  static constexpr Microseconds kQueue = 100'000;    ///< worth of bytes that may wait on the way beyond a round trip
  static constexpr Microseconds kOverdue = 250'000;  ///< behind what was expected: the link stands
  static constexpr Microseconds kPingEvery = 2'000'000;  ///< where nothing calls for it
  static constexpr Microseconds kDeaf = 3'000'000;       ///< without any pong: the client does not know pings
  static constexpr Microseconds kMeasurable = 100'000;   ///< what took less is not told from waiting for a processor

  /// Numbers of pings that are to go with a write. One in front tells the round trip alone, free of what bytes take.
  struct Pings {
    std::optional<std::int64_t> in_front, behind;
  };
  /// `bytes` are handed to the socket.
  [[nodiscard]] Pings write(std::size_t bytes, Microseconds now);
  /// The kernel has taken them.
  void taken() { under_way_since_.reset(); }
  /// An answer to a ping. One to none is ignored.
  void pong(std::int64_t number, Microseconds now);

  /// There is more on the way, with `waiting` bytes of pictures here, than the link carries in a round trip and a
  /// little more; or what should have arrived has not.
  [[nodiscard]] bool full(std::size_t waiting, Microseconds now) const;
  /// 0: not known.
  [[nodiscard]] double bytes_per_second() const { return rate_; }
  [[nodiscard]] Microseconds round_trip() const;

 private:
  struct Ping {
    std::int64_t number = 0;
    std::uint64_t upto = 0;  // bytes written before it, in all
    Microseconds began = 0;  // when the first of those since the ping before was written
    Microseconds sent = 0;
  };
  [[nodiscard]] bool deaf(Microseconds now) const {
    return !answers_ && !pings_.empty() && now - pings_.front().sent >= kDeaf;
  }
  [[nodiscard]] std::int64_t ping(Microseconds now);
  [[nodiscard]] bool probe_due(std::size_t bytes, Microseconds now) const;
  [[nodiscard]] bool ping_due(std::size_t bytes, Microseconds now) const;
  [[nodiscard]] Microseconds expected(std::uint64_t bytes) const;
  void note_round_trip(Microseconds took, Microseconds now);
  void learn(std::uint64_t bytes, Microseconds took, bool alone);

  std::deque<Ping> pings_;       // without a pong yet
  std::uint64_t written_ = 0;    // bytes, in all
  std::uint64_t arrived_ = 0;    // of these, as far as is known
  Microseconds arrived_at_ = 0;  // when that was known
  Microseconds began_ = 0;       // when the first byte since the last ping was written
  std::uint64_t pinged_upto_ = 0;
  std::optional<Microseconds> pinged_at_, probed_at_;
  std::optional<Microseconds> under_way_since_;
  std::optional<Microseconds> round_trip_now_, round_trip_before_;
  Microseconds round_trip_since_ = 0;
  double rate_ = 0;
  bool answers_ = false;  // a pong has come
};

}  // namespace darm::session
