#include "client/load/crowd.hpp"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

namespace darm::client::load {
namespace {

TEST(Crowd, GroupsAreEvenlyFilledAndEveryKindIsInEachOfThem) {
  CrowdShape shape;
  shape.clients = 100;
  shape.draw = 1;
  shape.decode = 3;
  shape.slow = 20;
  shape.vanish = 8;
  shape.teleport = 12;
  shape.places = 4;
  const auto crowd = plan_crowd(shape).value();
  std::array<int, 4> of_group{}, slow{}, vanishing{}, teleporting{};
  int draws = 0, decodes = 0;
  for (const auto& plan : crowd) {
    ++of_group[plan.group];
    slow[plan.group] += plan.role == Role::kSlow;
    vanishing[plan.group] += plan.role == Role::kVanishing;
    teleporting[plan.group] += plan.role == Role::kTeleporting;
    draws += plan.draws;
    decodes += plan.decodes;
    EXPECT_TRUE(!plan.decodes || plan.role == Role::kHealthy);
  }
  EXPECT_EQ(of_group, (std::array<int, 4>{25, 25, 25, 25}));
  EXPECT_EQ(slow, (std::array<int, 4>{5, 5, 5, 5}));
  EXPECT_EQ(vanishing, (std::array<int, 4>{2, 2, 2, 2}));
  EXPECT_EQ(teleporting, (std::array<int, 4>{3, 3, 3, 3}));
  EXPECT_EQ(draws, 1);
  EXPECT_EQ(decodes, 4);
}

TEST(Crowd, MoreRolesThanClientsAreRefused) {
  CrowdShape shape;
  shape.clients = 3;
  shape.decode = 2;
  shape.slow = 2;
  EXPECT_FALSE(plan_crowd(shape).has_value());
}

TEST(Crowd, TheFirstStallAndMayDraw) {
  CrowdShape shape;
  shape.clients = 4;
  shape.draw = 1;
  shape.stall = 2;
  shape.slow = 2;
  const auto crowd = plan_crowd(shape);
  ASSERT_TRUE(crowd.has_value());
  EXPECT_TRUE((*crowd)[0].draws);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ((*crowd)[i].role, i < 2 ? Role::kStalling : Role::kSlow) << i;
  shape.stall = 3;
  EXPECT_FALSE(plan_crowd(shape).has_value());
}

TEST(Crowd, ChurnNeedsSomebodyWhoMayLeave) {
  CrowdShape shape;
  shape.clients = 4;
  shape.decode = 2;
  shape.slow = 2;
  shape.churn = 1;
  EXPECT_FALSE(plan_crowd(shape).has_value());
  shape.clients = 5;
  EXPECT_TRUE(plan_crowd(shape).has_value());
}

TEST(Crowd, SpreadIsBoundedAndRepeatable) {
  CrowdShape shape;
  shape.clients = 1000;
  shape.spread = 2;
  const auto crowd = plan_crowd(shape).value(), again = plan_crowd(shape).value();
  double farthest = 0;
  glm::dvec3 mean(0);
  for (std::size_t i = 0; i < crowd.size(); ++i) {
    farthest = std::max(farthest, glm::length(crowd[i].shift));
    mean += crowd[i].shift / 1000.0;
    EXPECT_EQ(crowd[i].shift, again[i].shift);
    EXPECT_GE(crowd[i].late, 0);
    EXPECT_LT(crowd[i].late, 1);
  }
  EXPECT_LE(farthest, 2.0);
  EXPECT_GT(farthest, 1.8);
  EXPECT_LT(glm::length(mean), 0.15);
  shape.seed = 2;
  EXPECT_NE(plan_crowd(shape).value()[0].shift, crowd[0].shift);
}

}  // namespace
}  // namespace darm::client::load
