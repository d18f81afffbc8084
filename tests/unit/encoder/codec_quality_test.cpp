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

TEST(CodecQuality, AKeyFrameThatIsTooLargeIsCodedAgainAndTheNextOneIsRightAtOnce) {
  CodecQuality quality(18, 8);
  const auto size = [](float crf) { return static_cast<std::size_t>(1e6 * std::exp2((18 - crf) / 5)); };
  const float first = quality.next(true, 0.05f, 0, 250'000);
  EXPECT_EQ(first, 18);
  quality.coded(size(first), 0);
  ASSERT_TRUE(quality.too_large());
  const float second = quality.next(true, 0.05f, 0, 250'000);
  EXPECT_GE(second, 28);
  quality.coded(size(second), 0);
  EXPECT_FALSE(quality.too_large());
  EXPECT_LT(size(quality.next(true, 0.05f, kLater, 250'000)), 300'000u);
}

TEST(CodecQuality, LargeFramesMakeTheNextCoarserAndSmallOnesFinerStepByStep) {
  CodecQuality quality(18, 8);
  static_cast<void>(quality.next(true, 0.05f, 0, 100'000));
  quality.coded(90'000, 0);
  EXPECT_FALSE(quality.limited());
  static_cast<void>(quality.next(false, 0.05f, 1, 50'000));
  quality.coded(100'000, 1);
  EXPECT_FALSE(quality.too_large()) << "what others build on is not coded again";
  EXPECT_TRUE(quality.limited());
  EXPECT_FALSE(quality.settled()) << "there is more to send of the same picture";
  float before = quality.next(false, 0.05f, 2, 50'000);
  EXPECT_EQ(before, 24);
  for (int i = 1; i <= 3; ++i) {
    quality.coded(10'000, i * kLater + 2);
    const float now = quality.next(false, 0.05f, i * kLater + 3, 50'000);
    EXPECT_EQ(now, before - CodecQuality::kStep);
    before = now;
  }
  EXPECT_TRUE(quality.settled());
}

TEST(CodecQuality, WithoutALimitBytesSayNothing) {
  CodecQuality quality(18, 8);
  static_cast<void>(quality.next(true, 0.05f, 0));
  quality.coded(100'000'000, 0);
  EXPECT_FALSE(quality.limited());
  EXPECT_FALSE(quality.too_large());
}

TEST(CodecQuality, ALimitThatCannotBeMetEndsAtTheCoarsestThereIs) {
  CodecQuality quality(18, 8);
  for (int i = 0; i < 20; ++i) {
    EXPECT_LE(quality.next(true, 0.05f, i, 1), CodecQuality::kCoarsest);
    quality.coded(50'000, i);
  }
  EXPECT_EQ(quality.next(true, 0.05f, 20, 1), CodecQuality::kCoarsest);
  quality.coded(50'000, 20);
  EXPECT_FALSE(quality.too_large()) << "again would be no better";
}

}  // namespace
}  // namespace darm::encoder
