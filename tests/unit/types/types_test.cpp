#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <unordered_set>

#include "actors/types/camera.hpp"
#include "actors/types/error.hpp"
#include "actors/types/texel_mask.hpp"
#include "actors/types/tile_id.hpp"

namespace darm {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(CameraTest, LooksAtItsTarget) {
  const Camera camera = look_at({1, 2, 3}, {4, 6, 3}, 60);
  const glm::vec3 forward = camera.orientation * glm::vec3(0, 0, -1);
  EXPECT_NEAR(forward.x, 0.6f, 1e-6f);
  EXPECT_NEAR(forward.y, 0.8f, 1e-6f);
  EXPECT_NEAR(forward.z, 0, 1e-6f);
  const glm::vec3 right = camera.orientation * glm::vec3(1, 0, 0);
  EXPECT_NEAR(right.y, 0, 1e-6f);
}

TEST(CameraTest, AnyFiniteInputGivesAValidCamera) {
  EXPECT_TRUE(is_valid(look_at({0, 0, 0}, {0, 0, 0}, 60)));
  EXPECT_TRUE(is_valid(look_at({0, 0, 0}, {0, 5, 0}, 60)));
  EXPECT_TRUE(is_valid(look_at({0, 0, 0}, {1, 0, 0}, 0)));
  EXPECT_TRUE(is_valid(look_at({0, 0, 0}, {1, 0, 0}, 500)));
  EXPECT_TRUE(is_valid(look_at({0, 0, 0}, {1, 0, 0}, 60, {0, 0, 0})));
  EXPECT_TRUE(is_valid(look_at({0, 0, 0}, {1, 0, 0}, kNan)));
}

TEST(CameraTest, ForeignNonsenseIsInvalid) {
  Camera camera;
  EXPECT_TRUE(is_valid(camera));
  camera.position.x = kNan;
  EXPECT_FALSE(is_valid(camera));
  camera = {};
  camera.orientation = glm::quat(2, 0, 0, 0);
  EXPECT_FALSE(is_valid(camera));
  camera = {};
  camera.fovy = 4;
  EXPECT_FALSE(is_valid(camera));
  EXPECT_FALSE(is_valid(Viewport{0, 10}));
  EXPECT_FALSE(is_valid(Viewport{10, 20000}));
}

TEST(CameraTest, PictureCornersSpanTheFieldOfView) {
  const Camera camera = look_at({0, 0, 0}, {0, 0, -1}, 90);
  const Viewport square{100, 100};
  const glm::vec3 middle = ray_direction(camera, square, 50, 50);
  EXPECT_NEAR(middle.z, -1, 1e-6f);
  const glm::vec3 top = ray_direction(camera, square, 50, 0);
  EXPECT_NEAR(top.y, -top.z, 1e-5f);
  const glm::vec3 right = ray_direction(camera, square, 100, 50);
  EXPECT_NEAR(right.x, -right.z, 1e-5f);
  EXPECT_NEAR(glm::length(right), 1, 1e-6f);
  EXPECT_NEAR(pixel_spread(camera, square), 0.02f, 1e-6f);
}

TEST(TileIdTest, PacksLevelAndIndex) {
  const TileId id(15, kMaxTilesPerLevel - 1);
  EXPECT_EQ(id.level(), 15);
  EXPECT_EQ(id.index(), kMaxTilesPerLevel - 1);
  EXPECT_EQ(TileId(id.packed), id);
  EXPECT_LT(TileId(0, 7), TileId(1, 0));
}

TEST(TileIdTest, HashSpreadsNeighbours) {
  std::unordered_set<std::size_t> buckets;
  for (std::uint32_t i = 0; i < 4096; ++i) buckets.insert(std::hash<TileId>()(TileId(0, i)) % 8192);
  EXPECT_GT(buckets.size(), 2500u);
}

TEST(TexelMaskTest, SetsCountsAndJoins) {
  TexelMask a;
  EXPECT_TRUE(a.empty());
  a.set(0, 0);
  a.set(29, 29);
  EXPECT_EQ(a.count(), 2);
  EXPECT_TRUE(a.test(kTileTexels - 1));
  TexelMask b;
  b.set(29, 29);
  b.set(3, 4);
  a |= b;
  EXPECT_EQ(a.count(), 3);
  EXPECT_TRUE(a.test(3, 4));
  EXPECT_EQ(TexelMask::all().count(), kTileTexels);
  EXPECT_TRUE(TexelMask::all().contains(a));
  EXPECT_FALSE(a.contains(TexelMask::all()));
  EXPECT_TRUE(a.contains(a));
}

TEST(ErrorTest, ContextComesFirst) {
  EXPECT_EQ(Error("no such key").within("a.toml").message, "a.toml: no such key");
  const Result<int> result = fail("x");
  EXPECT_FALSE(result);
}

}  // namespace
}  // namespace darm
