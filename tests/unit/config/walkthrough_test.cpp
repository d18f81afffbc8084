#include "daemon/config/walkthrough.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace darm::config {
namespace {

std::vector<PathPose> straight() {
  return {{0, {0, 1, 0}, {0, 1, -5}, 60}, {1, {1, 1, 0}, {1, 1, -5}, 60}, {4, {4, 1, 0}, {4, 1, -5}, 60}};
}

TEST(WalkthroughTest, GoesThroughEveryEntry) {
  const auto path = Walkthrough::make(
      {{1, {0, 0, 0}, {1, 0, 0}, 40}, {2, {3, -1, 2}, {0, 5, 0}, 70}, {2.5, {7, 0, 0}, {0, 0, 9}, 50}});
  ASSERT_TRUE(path);
  for (const auto& pose : path->poses()) {
    const auto at = path->at(pose.t);
    EXPECT_NEAR(glm::length(at.position - pose.position), 0, 1e-12);
    EXPECT_NEAR(glm::length(at.target - pose.target), 0, 1e-12);
    EXPECT_NEAR(at.fovy_degrees, pose.fovy_degrees, 1e-12);
  }
}

TEST(WalkthroughTest, UniformMotionStaysUniformOverUnevenTimes) {
  const auto path = Walkthrough::make(straight());
  ASSERT_TRUE(path);
  for (double t = 0; t <= 4; t += 0.1) EXPECT_NEAR(path->at(t).position.x, t, 1e-12);
}

TEST(WalkthroughTest, VelocityIsContinuousAtEntries) {
  const auto path =
      Walkthrough::make({{0, {0, 0, 0}, {1, 0, 0}, 60}, {1, {5, 0, 0}, {1, 0, 0}, 60}, {3, {0, 0, 0}, {1, 0, 0}, 60}});
  ASSERT_TRUE(path);
  const double h = 1e-6;
  const double before = (path->at(1).position.x - path->at(1 - h).position.x) / h;
  const double after = (path->at(1 + h).position.x - path->at(1).position.x) / h;
  EXPECT_NEAR(before, after, 1e-3);
}

TEST(WalkthroughTest, HoldsItsEnds) {
  const auto path = Walkthrough::make(straight());
  ASSERT_TRUE(path);
  EXPECT_EQ(path->at(-5).position.x, 0);
  EXPECT_EQ(path->at(100).position.x, 4);
  EXPECT_EQ(path->at(std::numeric_limits<double>::quiet_NaN()).position.x, 0);
  EXPECT_TRUE(is_valid(path->camera_at(2.5)));
}

TEST(WalkthroughTest, OneEntryIsAStillCamera) {
  const auto path = Walkthrough::make({{0, {1, 2, 3}, {0, 0, 0}, 60}});
  ASSERT_TRUE(path);
  EXPECT_EQ(path->at(7).position, glm::dvec3(1, 2, 3));
}

TEST(WalkthroughTest, FaultsAreNamed) {
  const auto message = [](const char* json) {
    const auto path = Walkthrough::parse(json, "w.json");
    return path ? std::string("loads") : path.error().message;
  };
  EXPECT_EQ(message("[{"), "w.json: is not JSON");
  EXPECT_EQ(message("{}"), "w.json: is not a list of {t, position, target, fovy}");
  EXPECT_EQ(message("[]"), "w.json: has no entries; one is the least");
  EXPECT_EQ(message("[3]"), "w.json: entry 0: is not an object");
  EXPECT_EQ(message(R"([{"t": 0, "target": [0,0,0], "fovy": 60}])"), "w.json: entry 0: position is missing");
  EXPECT_EQ(message(R"([{"t": 0, "position": [0,0], "target": [0,0,0], "fovy": 60}])"),
            "w.json: entry 0: position is not a list of three numbers");
  EXPECT_EQ(message(R"([{"t": 0, "position": [0,0,1e300], "target": [0,0,0], "fovy": 60}])"),
            "w.json: entry 0: position is not within 1e7 of the origin");
  EXPECT_EQ(message(R"([{"t": 1, "position": [0,0,1], "target": [0,0,0], "fovy": 60},
                        {"t": 1, "position": [0,0,1], "target": [0,0,0], "fovy": 60}])"),
            "w.json: entry 1: t is not after that of the entry before");
  EXPECT_EQ(message(R"([{"t": 0, "position": [0,0,1], "target": [0,0,0], "fovy": 180}])"),
            "w.json: entry 0: fovy is not in 1..179 degrees");
}

TEST(WalkthroughTest, EvaluationWalkthroughsLoad) {
  for (const auto& entry : std::filesystem::directory_iterator(DARM_SOURCE_DIR "/config/walkthroughs")) {
    const auto path = Walkthrough::load(entry.path());
    EXPECT_TRUE(path) << path.error().message;
  }
}

TEST(WalkthroughTest, MissingFileIsAnError) { EXPECT_FALSE(Walkthrough::load("/nowhere/w.json")); }

}  // namespace
}  // namespace darm::config
