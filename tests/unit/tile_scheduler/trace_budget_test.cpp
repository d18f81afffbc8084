#include "actors/tile_scheduler/trace_budget.hpp"

#include <gtest/gtest.h>

namespace darm::tile_scheduler {
namespace {

constexpr Microseconds kTick = 10'000;

// Tries a refining trace of `rays` at every tick of a second; processor time taken by all, in microseconds.
double refine_for_a_second(TraceBudget& budget, Microseconds start, std::uint64_t rays, double true_ray_us) {
  double taken = 0;
  for (Microseconds now = start; now < start + 1'000'000; now += kTick) {
    if (!budget.allows(now)) continue;
    budget.begin(rays, now);
    const double busy = static_cast<double>(rays) * true_ray_us;
    budget.end(rays, static_cast<Microseconds>(busy));
    taken += busy;
  }
  return taken;
}

TEST(TraceBudget, RefiningTakesItsPartOfTheMachineAndNoMore) {
  for (const double true_ray_us : {0.3, 1.0, 4.0}) {
    TraceBudget budget(0.5);
    refine_for_a_second(budget, 0, 20'000, true_ray_us);  // it learns what a ray takes
    const double taken = refine_for_a_second(budget, 1'000'000, 20'000, true_ray_us);
    EXPECT_LE(taken, 0.5e6 + 20'000 * true_ray_us) << true_ray_us;
    // One trace may end within a tick, and the next waits for the tick after.
    EXPECT_GE(taken, 0.5e6 * 0.6) << true_ray_us;
  }
}

TEST(TraceBudget, AFewTracesThatFitNeverWait) {
  TraceBudget budget(0.5);
  for (Microseconds now = 0; now < 1'000'000; now += 100'000) {
    EXPECT_TRUE(budget.allows(now)) << now;
    budget.begin(40'000, now);
    budget.end(40'000, 40'000);
  }
}

TEST(TraceBudget, MovingViewsAreNotAskedAndTakeFromRefining) {
  TraceBudget budget(0.5);
  for (Microseconds now = 0; now < 1'000'000; now += kTick) {
    budget.begin(10'000, now);  // a processor of its own
    budget.end(10'000, 10'000);
    EXPECT_FALSE(budget.allows(now));
  }
  EXPECT_TRUE(budget.allows(3'000'000)) << "and a second or two later it is over";
}

TEST(TraceBudget, ManyWhoMoveShareOutWhatLookingMayTake) {
  TraceBudget budget(0.3, 0.8);
  EXPECT_EQ(budget.glance(2, 100'000), 40'000u);
  EXPECT_EQ(budget.glance(100, 100'000), 800u);
  EXPECT_EQ(budget.glance(1'000'000, 100'000), TraceBudget::kLeastGlance);
  for (int i = 0; i < 100; ++i) {  // a ray takes twice as long as it was thought to
    budget.begin(1000, i);
    budget.end(1000, 2000);
  }
  EXPECT_NEAR(budget.glance(10, 100'000), 4000, 40);
  EXPECT_GT(budget.glance(0, 100'000), 0u);
  EXPECT_EQ(budget.glance(5, 0), TraceBudget::kLeastGlance);
}

TEST(TraceBudget, WhatManyTookIsPaidOffInSeconds) {
  TraceBudget budget(0.3, 0.8);
  for (Microseconds now = 0; now < 60'000'000; now += 100'000) budget.begin(80'000, now);
  EXPECT_FALSE(budget.allows(60'000'000));
  EXPECT_TRUE(budget.allows(62'000'000));
}

TEST(TraceBudget, APauseIsNotSavedUp) {
  TraceBudget budget(0.5);
  EXPECT_TRUE(budget.allows(60'000'000));
  budget.begin(1'000'000, 60'000'000);
  EXPECT_FALSE(budget.allows(60'000'000 + 1'900'000));
  EXPECT_TRUE(budget.allows(60'000'000 + 2'000'000));
}

TEST(TraceBudget, AClockThatStandsOrGoesBackIsHarmless) {
  TraceBudget budget(1);
  budget.begin(1000, 5'000'000);
  EXPECT_FALSE(budget.allows(5'000'000));
  EXPECT_FALSE(budget.allows(1));
  budget.end(0, 12);
  budget.end(1000, -5);
  EXPECT_TRUE(budget.allows(5'001'000));
}

}  // namespace
}  // namespace darm::tile_scheduler
