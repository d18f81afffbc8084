// The frame-rate guard: how finely a picture is drawn while something moves, so that the hand is followed on any
// machine. A still view is always drawn at its finest. Pure.
#pragma once

#include <cstdint>

namespace darm::client::desktop {

class FrameGuard {
 public:
  /// A picture is drawn at 1/divisor of the window's pixels on a side, 1..kCoarsest.
  static constexpr std::uint32_t kCoarsest = 6;

  [[nodiscard]] std::uint32_t divisor() const { return divisor_; }
  /// A picture drawn with `divisor` while something moved took `ms`, until the GL was done with it. Those drawn with
  /// another divisor than the present one say nothing.
  void drawn(std::uint32_t divisor, double ms);

 private:
  std::uint32_t divisor_ = 1;
  int slow_ = 0;   // pictures in a row over the budget
  int quick_ = 0;  // and in a row so far under it that the next finer divisor would hold it
};

}  // namespace darm::client::desktop
