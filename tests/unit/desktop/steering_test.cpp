#include "client/desktop/steering.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

namespace darm::client::desktop {
namespace {

Rig rig(Mode mode) {
  Rig r(UprightView{}, {glm::dvec3(-10), glm::dvec3(10)});
  r.mode = mode;
  r.pivot = {0, 0, -5};
  return r;
}

TEST(Steering, AStickAtRestStaysAtRest) {
  for (const double v : {0.0, 0.1, -0.14, std::nan("")}) EXPECT_EQ(axis_of(v), 0) << v;
  EXPECT_EQ(axis_of(1), 1);
  EXPECT_EQ(axis_of(-1), -1);
  EXPECT_EQ(axis_of(7), 1);
  Rig still = rig(Mode::kWalk);
  Steering s;
  add(s, Sticks{});
  add(s, HeldKeys{});
  EXPECT_FALSE(steer(still, s, 0.1));
}

TEST(Steering, KeysAndSticksMoveTheSameWay) {
  Steering keys, pad;
  add(keys, HeldKeys{.ahead = true, .right = true, .down = true, .turn_left = true, .hurry = true});
  add(pad, Sticks{.left = {1, -1}, .right = {-1, 0}, .left_trigger = 1, .hurry = true});
  EXPECT_EQ(keys.wish, glm::dvec3(1, -1, 1));
  EXPECT_EQ(pad.wish, keys.wish);
  EXPECT_GT(keys.yaw, 0) << "left is positive";
  EXPECT_GT(pad.yaw, 0);
  EXPECT_TRUE(keys.hurry && pad.hurry);
}

TEST(Steering, AStepIsAsLongAsThePictureBeforeButNoLeapAfterARest) {
  EXPECT_DOUBLE_EQ(step_seconds(20, false), 0.02);
  EXPECT_DOUBLE_EQ(step_seconds(180, false), 0.18) << "five pictures a second walk as far as sixty";
  EXPECT_LE(step_seconds(4000, false), 0.25);
  EXPECT_EQ(step_seconds(-5, false), 0);
  EXPECT_LT(step_seconds(4000, true), 0.02);
}

TEST(Steering, KeysLookUpAndDown) {
  Steering up, down;
  add(up, HeldKeys{.look_up = true});
  add(down, HeldKeys{.look_down = true});
  EXPECT_GT(up.pitch, 0) << "up is positive";
  EXPECT_EQ(down.pitch, -up.pitch);
}

TEST(Steering, OppositeKeysCancel) {
  Steering s;
  add(s,
      HeldKeys{.ahead = true, .back = true, .turn_left = true, .turn_right = true, .look_up = true, .look_down = true});
  EXPECT_FALSE(s.any());
}

TEST(Steering, ADragAcrossTheWindowTurnsByTheFieldOfViewOrHalfAroundThePivot) {
  Rig walking = rig(Mode::kWalk);
  drag(walking, 1, 0, false);
  EXPECT_NEAR(walking.view.yaw, walking.view.fovy, 1e-12);
  Rig orbiting = rig(Mode::kOrbit);
  drag(orbiting, 1, 0, false);
  EXPECT_NEAR(std::abs(orbiting.view.yaw), kPi, 1e-9);
  EXPECT_LT(glm::distance(orbiting.view.position, glm::dvec3(0, 0, -10)), 1e-9) << "the other side of the pivot";
}

TEST(Steering, TheOtherButtonPansOrWalks) {
  Rig orbiting = rig(Mode::kOrbit);
  const double height = 2 * 5 * std::tan(orbiting.view.fovy / 2);
  drag(orbiting, 0.5, 0, true);
  EXPECT_NEAR(orbiting.view.position.x, -0.5 * height, 1e-9) << "the pivot follows the hand";
  Rig walking = rig(Mode::kWalk);
  drag(walking, 0, -0.5, true);
  EXPECT_LT(walking.view.position.z, 0) << "pushed away from the body: ahead";
}

TEST(Steering, TheWheelGoesAheadButNotInLeaps) {
  Rig few = rig(Mode::kWalk), many = rig(Mode::kWalk);
  roll(few, 5);
  roll(many, 500);
  EXPECT_LT(few.view.position.z, 0);
  EXPECT_EQ(few.view.position, many.view.position);
}

}  // namespace
}  // namespace darm::client::desktop
