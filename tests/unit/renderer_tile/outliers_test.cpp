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
  const float shared = (100 - outlier_bound(8)) / (36 * 36);
  EXPECT_NEAR(w.grey[at], outlier_bound(8) + shared, 1e-4);
  EXPECT_NEAR(w.irradiance[1][at], outlier_bound(8) + shared, 1e-4);
  EXPECT_LT(w.grey_m2[at], 1);
  EXPECT_NEAR(w.grey[at + 1], 1 + shared, 1e-4);
  EXPECT_NEAR(w.held_down * 36 * 36, 100 - outlier_bound(8), 1e-2);
}

// A room lit by one bright spot: in each texel one sample in many has nearly all the light.
TEST(Outliers, TheMeanOfAPatchStays) {
  auto w = even(16, 0.02f);
  for (std::size_t at = 0; at < w.grey.size(); ++at) {
    if (at % 3 == 0) w.patch[at] = 2;
    if (at % 41 != 0) continue;
    w.grey[at] = 7;
    w.irradiance[0][at] = 14;
  }
  const auto mean = [&](const std::vector<float>& plane, std::uint32_t patch) {
    double sum = 0, texels = 0;
    for (std::size_t at = 0; at < plane.size(); ++at)
      if (w.patch[at] == patch) sum += double{plane[at]}, ++texels;
    return sum / texels;
  };
  const auto grey = w.grey, red = w.irradiance[0];
  tame_outliers(w);
  EXPECT_GT(w.held_down, 0.0f);
  for (const std::uint32_t patch : {1u, 2u}) {
    EXPECT_NEAR(mean(w.grey, patch), mean(grey, patch), 1e-5);
    EXPECT_NEAR(mean(w.irradiance[0], patch), mean(red, patch), 1e-5);
  }
}

// The caustic of a tiny lamp: shared out in full, one sample of it makes a bright square.
TEST(Outliers, OneSampleAtMostDoublesTheLightOfItsPatch) {
  auto w = even(8, 0.1f);
  for (auto& channel : w.irradiance) channel[700] = 5000;
  w.grey[700] = 5000;
  tame_outliers(w);
  EXPECT_NEAR(w.grey[100], 0.2f, 2e-3f);
  EXPECT_NEAR(w.irradiance[2][100], 0.2f, 2e-3f);
  EXPECT_GT(w.held_down, 3.5f) << "all of it counts as error";
  auto sun = even(8, 0.1f);
  sun.grey[700] = 3.3e9f;  // a rounding error of which is more than all other light
  tame_outliers(sun);
  EXPECT_NEAR(sun.grey[100], 0.2f, 2e-3f);
}

TEST(Outliers, TheMoreTexelsLoseSomethingTheMoreOfItIsShared) {
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
