#include "actors/encoder/codec_quality.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace darm::encoder {
namespace {

constexpr Microseconds kLater = CodecQuality::kStepInterval;

TEST(CodecQuality, RoughLightIsCodedAtTheCoarsest) {
  CodecQuality quality(18, 8);
  EXPECT_EQ(quality.next(true, 0.05f, 0), 18);
  EXPECT_EQ(quality.next(false, 0.05f, 10 * kLater), 18);
  EXPECT_TRUE(quality.settled());
}

TEST(CodecQuality, ExactLightIsCodedFinerStepByStepUntilItIsSettled) {
  CodecQuality quality(18, 8);
  EXPECT_EQ(quality.next(true, 0.002f, 0), 18);  // whoever joins waits least
  EXPECT_FALSE(quality.settled());
  EXPECT_EQ(quality.next(false, 0.002f, kLater / 2), 18);
  float before = 18;
  for (int i = 1; i <= 5; ++i) {
    const float now = quality.next(false, 0.002f, i * kLater);
    EXPECT_EQ(now, before - CodecQuality::kStep);
    before = now;
  }
  EXPECT_EQ(quality.next(false, 0.002f, 6 * kLater), 8);
  EXPECT_TRUE(quality.settled());
}

TEST(CodecQuality, SmallChangesOfTheErrorChangeNothing) {
  CodecQuality quality(18, 0);
  static_cast<void>(quality.next(true, 0.006f, 0));
  for (int i = 1; i < 9; ++i) static_cast<void>(quality.next(false, 0.006f, i * kLater));
  const float at = quality.next(false, 0.006f, 9 * kLater);
  EXPECT_TRUE(quality.settled());
  EXPECT_EQ(quality.next(false, 0.0066f, 20 * kLater), at);
  EXPECT_EQ(quality.next(false, 0.0056f, 30 * kLater), at);
}

TEST(CodecQuality, NewViewsFallBackAtOnce) {
  CodecQuality quality(18, 8);
  static_cast<void>(quality.next(true, 0.001f, 0));
  for (int i = 1; i < 9; ++i) static_cast<void>(quality.next(false, 0.001f, i * kLater));
  EXPECT_EQ(quality.next(false, 0.05f, 9 * kLater), 18);
}

TEST(CodecQuality, AnUnknownErrorIsCodedAtTheCoarsest) {
  CodecQuality quality(18, 8);
  for (const float error : {0.0f, -1.0f, std::nanf("")})
    for (int i = 0; i < 4; ++i) EXPECT_EQ(quality.next(false, error, i * kLater), 18);
  CodecQuality crossed(10, 20);
  EXPECT_EQ(crossed.next(false, 0.001f, 10 * kLater), 10);
}

}  // namespace
}  // namespace darm::encoder
