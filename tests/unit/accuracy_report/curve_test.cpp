#include "daemon/accuracy/report/curve.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace darm::accuracy {
namespace {

const std::vector<Point> kCurve{{1, 30, 0}, {4, 32, 0}, {16, 34, 0}};

TEST(Curve, TimeGoesGeometricallyBetweenTwoPoints) {
  EXPECT_DOUBLE_EQ(*time_to(kCurve, 31), 2);
  EXPECT_DOUBLE_EQ(*time_to(kCurve, 33), 8);
  EXPECT_DOUBLE_EQ(*time_to(kCurve, 34), 16);
}

TEST(Curve, WhatIsThereAtOnceTakesTheFirstPicturesTime) { EXPECT_DOUBLE_EQ(*time_to(kCurve, 12), 1); }

TEST(Curve, WhatIsNeverReachedHasNoTime) {
  EXPECT_FALSE(time_to(kCurve, 34.01));
  EXPECT_FALSE(time_to({}, 1));
}

TEST(Curve, AGoodPictureThatGetsWorseAgainDoesNotCount) {
  EXPECT_DOUBLE_EQ(*time_to({{1, 33, 0}, {2, 30, 0}, {8, 34, 0}}, 32), 4);
}

TEST(Curve, PricesAddUpToTheWay) {
  const auto prices = decibel_prices(kCurve);
  ASSERT_EQ(prices.size(), 4u);
  EXPECT_EQ(prices.front().db, 30);
  double sum = 0;
  for (const auto& p : prices) sum += p.seconds;
  EXPECT_DOUBLE_EQ(sum, 15);
  EXPECT_DOUBLE_EQ(prices.back().reached, 16);
}

TEST(Curve, OddCurvesHaveNoPrices) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(decibel_prices({}).empty());
  EXPECT_TRUE(decibel_prices({{1, 30, 0}}).empty());
  EXPECT_TRUE(decibel_prices({{1, 34, 0}, {2, 30, 0}}).empty());
  EXPECT_TRUE(decibel_prices({{1, nan, 0}, {2, 30, 0}}).empty());
  for (const auto& p : decibel_prices({{0, 10, 0}, {2, 30, 0}})) EXPECT_TRUE(std::isfinite(p.seconds));
}

TEST(Curve, ARatioNeedsBothToGetThere) {
  EXPECT_DOUBLE_EQ(*time_ratio(kCurve, {{2, 32, 0}}, 32), 2);
  EXPECT_FALSE(time_ratio(kCurve, {{2, 32, 0}}, 33));
}

}  // namespace
}  // namespace darm::accuracy
