#include "actors/renderer/outliers.hpp"

#include <gtest/gtest.h>

namespace darm::renderer {
namespace {

FilterWindow even(float count, float grey) {
  FilterWindow w;
  w.reset(2);
  for (std::size_t at = 0; at < w.count.size(); ++at) {
    w.patch[at] = 1;
    w.count[at] = count;
    w.grey[at] = grey;
    w.grey_m2[at] = 1;
    for (auto& channel : w.irradiance) channel[at] = grey;
  }
  return w;
}

TEST(Outliers, ALoneBrightTexelIsHeldToItsBound) {
  auto w = even(8, 1);
  const std::size_t at = 18 * 36 + 18;
  w.grey[at] = 100;
  for (auto& channel : w.irradiance) channel[at] = 100;
  tame_outliers(w);
  EXPECT_NEAR(w.grey[at], outlier_bound(8), 1e-4);
  EXPECT_NEAR(w.irradiance[1][at], outlier_bound(8), 1e-4);
  EXPECT_LT(w.grey_m2[at], 1);
  EXPECT_EQ(w.grey[at + 1], 1);
  EXPECT_NEAR(w.held_down * 36 * 36, 100 - outlier_bound(8), 1e-2);
}

TEST(Outliers, AnEdgeOfLightStays) {
  auto w = even(2, 0.1f);
  for (int y = 0; y < w.size; ++y)
    for (int x = w.size / 2; x < w.size; ++x) {
      const auto at = static_cast<std::size_t>(y * w.size + x);
      w.grey[at] = 0.25f;
    }
  const auto before = w.grey;
  tame_outliers(w);
  EXPECT_EQ(w.grey, before);
}

TEST(Outliers, EnoughSamplesAreLeftAlone) {
  auto w = even(kOutlierSamples, 1);
  w.grey[700] = 1e6f;
  tame_outliers(w);
  EXPECT_EQ(w.grey[700], 1e6f);
}

TEST(Outliers, AnotherPatchSaysNothing) {
  auto w = even(4, 0.01f);
  w.patch[700] = 2;
  w.grey[700] = 5;
  tame_outliers(w);
  EXPECT_EQ(w.grey[700], 5);
}

}  // namespace
}  // namespace darm::renderer
