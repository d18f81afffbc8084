#include "daemon/config/camera_spec.hpp"

#include <gtest/gtest.h>

namespace darm::config {
namespace {

const std::vector<Pose> kPoses{{"door", {1, 2, 3}, {4, 5, 6}, 50}};
const std::vector<scene::NamedCamera> kScene{{"cam", look_at({9, 9, 9}, {0, 0, 0}, 30)},
                                             {"door", look_at({0, 0, 0}, {1, 0, 0}, 30)}};

TEST(CameraSpecTest, NumbersGiveACamera) {
  const auto camera = parse_camera_spec("-1,2.5,3e0 4,5,6 50", {}, {});
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->position, glm::dvec3(-1, 2.5, 3));
  const Camera expected = look_at({-1, 2.5, 3}, {4, 5, 6}, 50);
  EXPECT_EQ(camera->orientation, expected.orientation);
  EXPECT_EQ(camera->fovy, expected.fovy);
}

TEST(CameraSpecTest, FovyMayBeLeftOutAndSpacesRepeat) {
  const auto camera = parse_camera_spec(" 1,2,3   4,5,6 ", {}, {});
  ASSERT_TRUE(camera);
  EXPECT_FLOAT_EQ(camera->fovy, look_at({1, 2, 3}, {4, 5, 6}, 60).fovy);
}

TEST(CameraSpecTest, NamesOfTheSetUpComeBeforeThoseOfTheScene) {
  EXPECT_EQ(parse_camera_spec("door", kPoses, kScene)->position, glm::dvec3(1, 2, 3));
  EXPECT_EQ(parse_camera_spec("cam", kPoses, kScene)->position, glm::dvec3(9, 9, 9));
}

TEST(CameraSpecTest, UnknownNameListsTheKnownOnes) {
  const auto camera = parse_camera_spec("dor", kPoses, kScene);
  ASSERT_FALSE(camera);
  EXPECT_NE(camera.error().message.find("door, cam"), std::string::npos) << camera.error().message;
}

TEST(CameraSpecTest, NamesThatSetUpAndSceneShareAreListedOnce) {
  const auto camera = parse_camera_spec("dor", kPoses, kScene);
  ASSERT_FALSE(camera);
  const auto& message = camera.error().message;
  EXPECT_EQ(message.find(kPoses[0].name), message.rfind(kPoses[0].name)) << message;
}

TEST(CameraSpecTest, BadNumbersAreErrors) {
  for (const char* spec :
       {"", "1,2,3", "1,2 3,4,5 60", "1,2,x 3,4,5 60", "1,2,3 4,5,6 0", "1,2,3 4,5,6 nan", "inf,2,3 4,5,6 60",
        "1,2,3 4,5,6 60 7", "1e9,2,3 4,5,6 60", "1,2,3, 4,5,6 60", "1,2,3 1,2,3 60"})
    EXPECT_FALSE(parse_camera_spec(spec, {}, {})) << spec;
}

}  // namespace
}  // namespace darm::config
