#include "actors/renderer/outliers.hpp"

#include <gtest/gtest.h>

namespace darm::renderer {
namespace {

LightSquare even(float count, float grey) {
  LightSquare s;
  s.reset(36);
  s.patch.assign(s.patch.size(), 1);
  s.count.assign(s.count.size(), count);
  s.grey.assign(s.grey.size(), grey);
  return s;
}

std::vector<Outlier> outliers_of(const LightSquare& square) {
  std::vector<Outlier> found{{1, 2.0f}};  // of another square
  find_outliers(square, found);
  return found;
}

TEST(Outliers, ALoneBrightTexelIsHeldToItsBound) {
  auto s = even(8, 1);
  const std::size_t at = 18 * 36 + 18;
  s.grey[at] = 100;
  const auto found = outliers_of(s);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].at, at);
  EXPECT_NEAR(found[0].scale * 100, outlier_bound(8), 1e-4);
}

TEST(Outliers, AnEdgeOfLightStays) {
  auto s = even(2, 0.1f);
  for (int y = 0; y < s.size; ++y)
    for (int x = s.size / 2; x < s.size; ++x) s.grey[static_cast<std::size_t>(y * s.size + x)] = 0.25f;
  EXPECT_TRUE(outliers_of(s).empty());
}

TEST(Outliers, EnoughSamplesAreLeftAlone) {
  auto s = even(kOutlierSamples, 1);
  s.grey[700] = 1e6f;
  EXPECT_TRUE(outliers_of(s).empty());
}

TEST(Outliers, AnotherPatchSaysNothing) {
  auto s = even(4, 0.01f);
  s.patch[700] = 2;
  s.grey[700] = 5;
  EXPECT_TRUE(outliers_of(s).empty());
}

TEST(Outliers, BesideTheDarkIsHeldToNothing) {
  auto s = even(4, 0);
  s.grey[700] = 5;
  const auto found = outliers_of(s);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].scale, 0.0f);
}

}  // namespace
}  // namespace darm::renderer
