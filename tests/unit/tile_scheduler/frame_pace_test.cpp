#include "actors/tile_scheduler/frame_pace.hpp"

#include <gtest/gtest.h>

namespace darm::tile_scheduler {
namespace {

FramePace learned(double processors, Microseconds frame) {
  FramePace pace(processors);
  for (int i = 0; i < 200; ++i) pace.done(frame);
  return pace;
}

TEST(FramePace, OneStreamIsNeverHeldBack) {
  EXPECT_EQ(FramePace(0.5).interval(1, false), 0);
  EXPECT_EQ(learned(0.1, 200'000).interval(1, false), 0) << "on a machine that is busy with something else";
}

TEST(FramePace, ManyStreamsTogetherTakeTheirPartOfTheMachineAndNoMore) {
  for (const std::size_t streams : {2u, 8u, 20u}) {
    const auto pace = learned(0.5, 40'000);
    const double frames_a_second =
        1e6 * static_cast<double>(streams) / static_cast<double>(pace.interval(streams, false));
    EXPECT_NEAR(frames_a_second * 0.04, 0.5, 0.01) << streams;
  }
}

TEST(FramePace, AMovingViewHasTwiceTheFramesOfAStillOne) {
  const auto pace = learned(0.5, 40'000);
  EXPECT_NEAR(static_cast<double>(pace.interval(8, true)) * 2, static_cast<double>(pace.interval(8, false)), 2);
}

TEST(FramePace, NoStreamIsSilentForMoreThanTwoSeconds) {
  EXPECT_LE(learned(0.1, 10'000'000).interval(1000, false), 2'000'000);
}

TEST(FramePace, UnknownAndImpossibleTimesTeachNothing) {
  FramePace pace(0.5);
  const auto before = pace.interval(8, false);
  pace.done(0);
  pace.done(-7);
  EXPECT_EQ(pace.interval(8, false), before);
}

}  // namespace
}  // namespace darm::tile_scheduler
