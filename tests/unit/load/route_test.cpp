#include "client/load/route.hpp"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

namespace darm::client::load {
namespace {

// Ten metres along X in ten seconds, looking ahead.
std::vector<CameraKey> line() {
  std::vector<CameraKey> path;
  for (int t = 0; t <= 10; ++t) path.push_back({double(t), {double(t), 1.7, 0}, {t + 5.0, 1.7, 0}, 60});
  return path;
}

CameraKey stand(double x) { return {0, {x, 1.7, 0}, {x + 5, 1.7, 0}, 60}; }

ClientPlan member(std::uint32_t index, std::uint32_t group) {
  ClientPlan plan;
  plan.index = index;
  plan.group = group;
  return plan;
}

TEST(Route, GroupsBeginWhereTheWalkthroughPassesTheirPlace) {
  const Route route(line(), {stand(2), stand(7)}, 4);
  EXPECT_EQ(route.places(), 2u);
  EXPECT_NEAR(route.at(member(0, 0), 0)->position.x, 2, 0.06);
  EXPECT_NEAR(route.at(member(1, 1), 0)->position.x, 7, 0.06);
  EXPECT_NEAR(route.at(member(1, 1), 2)->position.x, 9, 0.06);
}

TEST(Route, NobodyJumpsAtTheEndOfTheWalkthrough) {
  const Route route(line(), {stand(7)}, 1);
  auto before = *route.at(member(0, 0), 0);
  for (double t = 0.1; t < 45; t += 0.1) {
    const auto now = *route.at(member(0, 0), t);
    EXPECT_LT(glm::length(now.position - before.position), 0.2) << t;
    EXPECT_GE(now.position.x, 0);
    EXPECT_LE(now.position.x, 10);
    before = now;
  }
}

TEST(Route, WithoutGroupsClientsAreSpreadOverTheWalkthrough) {
  const Route route(line(), {}, 5);
  for (std::uint32_t i = 0; i < 5; ++i) EXPECT_NEAR(route.at(member(i, 0), 0)->position.x, 2.0 * i, 0.01);
}

TEST(Route, TheShiftMovesTheCameraAndNotItsDirection) {
  const Route route({}, {stand(3)}, 1);
  auto plan = member(0, 0);
  plan.shift = {0, 0.1, 0.5};
  const auto key = *route.at(plan, 12);
  EXPECT_EQ(key.position, glm::dvec3(3, 1.8, 0.5));
  EXPECT_EQ(key.target - key.position, glm::dvec3(5, 0, 0));
}

TEST(Route, TeleportingClientsLookFromElsewhereEverySecond) {
  const Route route(line(), {stand(2)}, 1);
  auto plan = member(0, 0);
  plan.role = Role::kTeleporting;
  plan.seed = 11;
  EXPECT_EQ(route.at(plan, 3.1)->position, route.at(plan, 3.8)->position);
  int jumps = 0;
  for (int t = 0; t < 20; ++t)
    jumps += glm::length(route.at(plan, t + 1.5)->position - route.at(plan, t + 0.5)->position) > 0.5 ? 1 : 0;
  EXPECT_GT(jumps, 12);
}

TEST(Route, WithoutPlacesOnlyTheServerKnowsACamera) { EXPECT_FALSE(Route({}, {}, 1).at(member(0, 0), 0).has_value()); }

}  // namespace
}  // namespace darm::client::load
