#include "client/desktop/frame_guard.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace darm::client::desktop {
namespace {

// Pictures of `finest_ms` at full resolution, whose cost goes with their pixels, until nothing changes any more.
std::uint32_t settle(FrameGuard& guard, double finest_ms, int pictures = 1000) {
  for (int i = 0; i < pictures; ++i) {
    const double side = guard.divisor();
    guard.drawn(guard.divisor(), finest_ms / (side * side));
  }
  return guard.divisor();
}

TEST(FrameGuard, AQuickDeviceIsNeverCoarsened) {
  FrameGuard guard;
  EXPECT_EQ(settle(guard, 30), 1u);
}

TEST(FrameGuard, ASlowDeviceComesIntoTheBudgetWithinAFewPictures) {
  for (const double finest_ms : {40.0, 120.0, 600.0, 1100.0}) {
    FrameGuard guard;
    const double side = settle(guard, finest_ms, 6);
    EXPECT_LE(finest_ms / (side * side), 33) << finest_ms;
    EXPECT_GT(finest_ms / ((side - 1) * (side - 1)), 33) << finest_ms << ": no coarser than it has to be";
  }
}

TEST(FrameGuard, ItEndsAtTheCoarsest) {
  FrameGuard guard;
  EXPECT_EQ(settle(guard, 1e9), FrameGuard::kCoarsest);
}

TEST(FrameGuard, OneSlowPictureIsNotBelieved) {
  FrameGuard guard;
  guard.drawn(1, 900);  // a shader's first use
  for (int i = 0; i < 10; ++i) guard.drawn(1, 20);
  guard.drawn(1, 900);
  EXPECT_EQ(guard.divisor(), 1u);
}

TEST(FrameGuard, ItDoesNotSwingBetweenTwoDivisors) {
  for (double finest_ms = 34; finest_ms < 1100; finest_ms *= 1.07) {
    FrameGuard guard;
    const auto side = settle(guard, finest_ms);
    for (int i = 0; i < 500; ++i) ASSERT_EQ(settle(guard, finest_ms, 1), side) << finest_ms;
  }
}

TEST(FrameGuard, ADeviceThatBecomesQuickDrawsFinelyAgain) {
  FrameGuard guard;
  ASSERT_GT(settle(guard, 600), 3u);
  EXPECT_EQ(settle(guard, 5), 1u);
}

TEST(FrameGuard, PicturesOfAnotherDivisorSayNothing) {
  FrameGuard guard;
  for (int i = 0; i < 10; ++i) guard.drawn(3, 900);
  for (int i = 0; i < 10; ++i) guard.drawn(1, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(guard.divisor(), 1u);
}

}  // namespace
}  // namespace darm::client::desktop
