// How much of the machine looking may take from lighting. Pure.
#pragma once

#include <cstdint>

#include "actors/types/frame_stamps.hpp"

namespace darm::tile_scheduler {

/// Visibility comes before light, because a moving view must be answered at once; but passes that only refine a still
/// view would then leave nothing for light once there are a few views. They share a part of all processor time and wait
/// while it is spent; what moving views take counts too, and never waits. Where many move, each look has fewer rays.
class TraceBudget {
 public:
  static constexpr std::uint32_t kLeastGlance = 128;

  /// `processors`: processor time that may be spent in a second of wall time, more than 0. `moving`: and by views that
  /// move.
  explicit TraceBudget(double processors, double moving = 1);

  /// Whether a refining trace may begin now.
  [[nodiscard]] bool allows(Microseconds now);
  /// A trace of so many rays begins: what it is expected to take is spent.
  void begin(std::uint64_t rays, Microseconds now);
  /// That trace took so much processor time: the expectation is put right. `busy` 0 or more.
  void end(std::uint64_t rays, Microseconds busy);
  /// Rays of a look of one of `moving` views that move, each looked at once a `period`: at least kLeastGlance.
  [[nodiscard]] std::uint32_t glance(std::size_t moving, Microseconds period) const;

 private:
  void pay(Microseconds now);

  double processors_;
  double moving_;
  double ray_us_ = 1.0;  // what a ray is expected to take
  double debt_us_ = 0;   // processor time spent beyond what has been earned
  Microseconds paid_at_ = 0;
};

}  // namespace darm::tile_scheduler
