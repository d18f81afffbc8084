// How often each of many streams may send a frame, so that coding leaves the machine to light. Pure.
#pragma once

#include <cstddef>

#include "actors/types/frame_stamps.hpp"

namespace darm::tile_scheduler {

/// A frame costs the same whatever it holds, and comes before light. One stream is never held back; where many share
/// the machine each of them gets its part of what coding may take. A view that moves gets twice that of one that rests:
/// what it lacks is new, not finer.
class FramePace {
 public:
  /// `processors`: processor time that coding may take in a second of wall time, more than 0. `longest`: no stream is
  /// silent for longer.
  explicit FramePace(double processors, Microseconds longest = 2'000'000);

  /// A frame took so much processor time. 0 or less: nothing is learned.
  void done(Microseconds busy);
  /// Least time between two frames of one of `streams` streams.
  [[nodiscard]] Microseconds interval(std::size_t streams, bool moving) const;

 private:
  double processors_;
  double longest_us_;
  double frame_us_ = 30'000;  // what a frame is expected to take
};

}  // namespace darm::tile_scheduler
