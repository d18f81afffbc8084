#include "client/desktop/rig.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

namespace darm::client::desktop {
namespace {

Rig rig_in(double size, const glm::dvec3& position = glm::dvec3(0)) {
  UprightView view;
  view.position = position;
  return {view, {glm::dvec3(-size), glm::dvec3(size)}};
}

TEST(UprightView, HasTheAxesOfTheOrientationThatTravels) {
  const UprightView view{{1, 2, 3}, 0.7, -0.3, 1};
  const View sent = to_view(view, 100, 50);
  EXPECT_LT(glm::distance(sent.orientation * glm::dvec3(0, 0, -1), forward(view)), 1e-12);
  EXPECT_LT(glm::distance(sent.orientation * glm::dvec3(1, 0, 0), right(view)), 1e-12);
  EXPECT_LT(glm::distance(sent.orientation * glm::dvec3(0, 1, 0), up(view)), 1e-12);
  const UprightView back = upright(sent);
  EXPECT_EQ(back.position, view.position);
  EXPECT_NEAR(back.yaw, view.yaw, 1e-12);
  EXPECT_NEAR(back.pitch, view.pitch, 1e-12);
  EXPECT_EQ(back.fovy, view.fovy);
}

TEST(UprightView, LooksAlongAnyDirection) {
  for (const glm::dvec3 d : {glm::dvec3(1, 0, 0), glm::dvec3(-1, 2, 0.5), glm::dvec3(0, 0, 1), glm::dvec3(0, -5, 0)}) {
    // Straight down is held a thousandth of a radian short.
    EXPECT_LT(glm::distance(forward(view_along({0, 0, 0}, d, 1)), glm::normalize(d)), 2e-3);
  }
}

TEST(UprightView, NoInputGivesAViewThatCannotBeDrawn) {
  const UprightView wild = tidy({{NAN, INFINITY, 1}, 1e9, 9, NAN});
  EXPECT_EQ(wild.position, glm::dvec3(0, 0, 1));
  EXPECT_LE(std::abs(wild.yaw), kPi);
  EXPECT_EQ(wild.pitch, kSteepest);
  EXPECT_NEAR(wild.fovy, 50 * kDegree, 1e-12);
}

TEST(Rig, SpeedsSuitAThingOfSevenMillimetresAndAValleyOfThreeKilometres) {
  const auto crossing = [](double diagonal) { return diagonal / walk_speed(diagonal); };
  EXPECT_GT(crossing(0.007), 5);
  EXPECT_LT(crossing(0.007), 20) << "a thing on the table is crossed in seconds";
  EXPECT_NEAR(walk_speed(20), 1.6, 1e-9) << "a house is walked at a person's pace";
  EXPECT_GT(crossing(3000), 60);
  EXPECT_LT(crossing(3000), 300) << "a valley is crossed in minutes";
  for (double d = 0.001; d < 1e5; d *= 1.5) EXPECT_GT(walk_speed(d * 1.5), walk_speed(d)) << "larger is never slower";
}

TEST(Rig, WalksLevelWhateverIsLookedAtAndHurriesFaster) {
  Rig slow = rig_in(10);
  slow.look(0, -1);
  for (int i = 0; i < 100; ++i) slow.walk({0, 0, 1}, false, 0.02);
  EXPECT_NEAR(slow.view.position.y, 0, 1e-12);
  const double pace = walk_speed(slow.diagonal());
  EXPECT_GT(-slow.view.position.z, 1.8 * pace);
  EXPECT_LT(-slow.view.position.z, 2.0 * pace) << "speed eases in";
  Rig fast = rig_in(10);
  for (int i = 0; i < 100; ++i) fast.walk({0, 0, 1}, true, 0.02);
  EXPECT_GT(fast.view.position.z, 4.01 * slow.view.position.z);
  EXPECT_LT(fast.view.position.z, 2 * slow.view.position.z);
}

TEST(Rig, TwoKeysAtOnceAreNotFasterThanOne) {
  Rig rig = rig_in(10);
  rig.walk({1, 0, 1}, false, 100);
  EXPECT_NEAR(glm::length(rig.view.position), 100 * walk_speed(rig.diagonal()), 1e-6);
}

TEST(Rig, ComesToRestByItself) {
  Rig rig = rig_in(10);
  rig.walk({0, 0, 1}, false, 0.05);
  EXPECT_TRUE(rig.moving());
  for (int i = 0; i < 200; ++i) rig.walk({0, 0, 0}, false, 0.016);
  EXPECT_FALSE(rig.moving());
}

TEST(Rig, AnOrbitKeepsThePivotAtItsPlaceOnTheScreenAndAtItsDistance) {
  Rig rig = rig_in(10, {30, 5, 0});
  EXPECT_EQ(rig.mode, Mode::kOrbit) << "an eye outside looks at an object";
  rig.view.yaw = kPi / 2;
  const auto seen = [&] {
    const glm::dvec3 arm = rig.pivot - rig.view.position;
    return glm::dvec3(glm::dot(arm, right(rig.view)), glm::dot(arm, up(rig.view)), glm::dot(arm, forward(rig.view)));
  };
  const glm::dvec3 before = seen();
  for (int i = 0; i < 50; ++i) rig.orbit(0.1, -0.02);
  EXPECT_LT(glm::distance(seen(), before), 1e-9);
}

TEST(Rig, ComingNearerNeverPassesThePivot) {
  Rig rig = rig_in(0.0035, {0.02, 0, 0});
  for (int i = 0; i < 1000; ++i) rig.dolly(1);
  EXPECT_GT(rig.view.position.x, 0);
  for (int i = 0; i < 1000; ++i) rig.dolly(-1);
  EXPECT_LT(rig.view.position.x, 1);
}

TEST(Rig, AnEyeInsideWalks) { EXPECT_EQ(rig_in(10, {3, 1, -2}).mode, Mode::kWalk); }

}  // namespace
}  // namespace darm::client::desktop
