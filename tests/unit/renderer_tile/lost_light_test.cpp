#include "actors/renderer/lost_light.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "actors/types/tile_id.hpp"

namespace darm::renderer {
namespace {

constexpr int kNine = 3 * kTileSize;

LightSquare even(float grey) {
  LightSquare s;
  s.reset(kNine);
  s.patch.assign(s.patch.size(), 1);
  s.count.assign(s.count.size(), 8.0f);
  s.grey.assign(s.grey.size(), grey);
  return s;
}

// Loses `grey` of a tile's patch, in a light whose red is twice its grey.
void lose(LostLight& lost, int tile, std::uint32_t patch, float grey) {
  lost.take(tile, patch, glm::vec3(2 * grey, grey, grey / 2), grey);
}

TEST(LostLight, NothingLostNothingGiven) {
  LostLight lost;
  lost.measure(even(1));
  EXPECT_TRUE(lost.empty());
  const auto share = lost.at(1, 5, 5);
  EXPECT_EQ(share.irradiance, glm::vec3(0.0f));
  EXPECT_EQ(share.grey, 0.0f);
  EXPECT_EQ(share.error, 0.0f);
}

// A room lit by one bright spot: in each tile some texels have nearly all the light. 500 texels that lost 2 each.
TEST(LostLight, WhereManyLoseAlikeTheMeanOfAPatchStays) {
  auto square = even(3);
  for (std::size_t at = 0; at < square.patch.size(); at += 3) square.patch[at] = 2;  // 30 is 10 times 3: whole columns
  LostLight lost;
  for (int tile = 0; tile < 9; ++tile)
    for (int n = 0; n < 500; ++n) lose(lost, tile, n < 100 ? 2 : 1, 2.0f);
  lost.measure(square);
  for (int y = 0; y < kSlotSize; ++y)
    for (int x = 0; x < kSlotSize; ++x) {
      const auto one = lost.at(1, x, y), two = lost.at(2, x, y);
      ASSERT_NEAR(one.irradiance.x, 2 * 800.0f / 600, 1e-5);
      ASSERT_NEAR(one.grey, 800.0f / 600, 1e-5);
      ASSERT_EQ(one.trusted, 1.0f);
      ASSERT_NEAR(two.irradiance.z, 0.5f * 200.0f / 300, 1e-5);
      ASSERT_NEAR(two.grey, 200.0f / 300, 1e-5);
      ASSERT_LT(one.error, 0.1f * one.grey) << "known from thousands";
    }
}

// The caustic of a tiny lamp: shared out in full, one sample of it makes a bright spot.
TEST(LostLight, OneSampleAtMostDoublesTheLightOfItsPatch) {
  for (const float bright : {5000.0f, 3.3e9f}) {  // a rounding error of the latter is more than all other light
    auto square = even(0.1f);
    square.grey[45 * kNine + 45] = bright;
    LostLight lost;
    lose(lost, 4, 1, bright);
    lost.measure(square);
    const auto middle = lost.at(1, 16, 16);
    EXPECT_NEAR(middle.irradiance.y * middle.trusted, 0.1f, 1e-4);
    EXPECT_NEAR(middle.grey / bright, 0.75 * 0.75 / 900, 1e-5);
    EXPECT_GT(middle.error, middle.grey) << "there may be as much again";
    const auto corner = lost.at(1, 31, 0);
    EXPECT_LE(corner.irradiance.y * corner.trusted, 0.1f);
  }
}

TEST(LostLight, TheMoreTexelsLoseSomethingTheMoreOfItIsShared) {
  EXPECT_EQ(share_to_trust(0, 0, 1), 1.0f);
  EXPECT_EQ(share_to_trust(10, 100, 20), 1.0f) << "less than is there";
  EXPECT_FLOAT_EQ(share_to_trust(1000, 1e6, 100), 0.1f);
  float before = 0;
  for (const double n : {1.0, 2.0, 4.0, 64.0, 1024.0}) {
    const float share = share_to_trust(1000, 1e6 / n, 1);
    EXPECT_GT(share, before);
    before = share;
  }
  EXPECT_GT(before, 0.99f);
}

// Twelve tiles in a row of four; each of two that meet knows nine of them.
TEST(LostLight, TilesThatMeetGiveTheSameToBothSidesOfTheirBorder) {
  std::mt19937 random(7);
  std::lognormal_distribution<float> light(0.0f, 2.0f);
  LostLight left, right;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      for (int n = 0; n < 20; ++n) {
        const float grey = light(random);
        if (column < 3) lose(left, row * 3 + column, 1, grey);
        if (column > 0) lose(right, row * 3 + column - 1, 1, grey);
      }
  left.measure(even(1));
  right.measure(even(1));
  float least = 1e9f, most = 0;
  for (int y = 1; y <= kTileSize; ++y)
    for (int x = 0; x < 2; ++x) {  // texels to either side of the border: slots 30, 31 of the left tile
      const float one = left.at(1, kTileSize + x, y).irradiance.y;
      const float other = right.at(1, x, y).irradiance.y;
      EXPECT_NEAR(one / other, 1, 0.015);
      least = std::min(least, one);
      most = std::max(most, one);
    }
  for (int y = 1; y <= kTileSize; ++y)
    for (int x = 1; x <= kTileSize; ++x) {
      least = std::min({least, left.at(1, x, y).irradiance.y, right.at(1, x, y).irradiance.y});
      most = std::max({most, left.at(1, x, y).irradiance.y, right.at(1, x, y).irradiance.y});
    }
  EXPECT_GT(most / least, 1.1) << "or there was nothing to join";
}

}  // namespace
}  // namespace darm::renderer
