#include "actors/renderer/display_curve.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace darm::renderer {
namespace {

double exact_srgb(double x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055; }

TEST(DisplayCurveTest, code_is_the_rounded_curve) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> exponent(-14.0f, 0.0f);
  for (int i = 0; i < 200'000; ++i) {
    const float x = std::exp2(exponent(random));
    const double exact = 255.0 * exact_srgb(x);
    ASSERT_NEAR(srgb_code(x), exact, 0.5001) << x;
  }
  for (int c = 0; c < 256; ++c) {
    const double v = c / 255.0;
    const double x = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
    EXPECT_EQ(srgb_code(static_cast<float>(x)), c);
  }
}

TEST(DisplayCurveTest, values_between_codes_rise_with_the_curve) {
  float before = 0;
  for (int i = 0; i <= 1'000'000; ++i) {
    const float x = static_cast<float>(i) * 1.1e-6f;
    const float shown = srgb(x);
    ASSERT_GE(shown, before) << x;
    ASSERT_NEAR(shown, exact_srgb(std::min(1.0f, x)), 5e-5) << x;
    before = shown;
  }
  EXPECT_EQ(srgb(std::nanf("")), 0.0f);
  EXPECT_EQ(srgb(-1.0f), 0.0f);
  EXPECT_EQ(srgb(std::numeric_limits<float>::infinity()), 1.0f);
}

TEST(DisplayCurveTest, what_is_no_number_or_out_of_range_is_clamped) {
  EXPECT_EQ(srgb_code(std::nanf("")), 0);
  EXPECT_EQ(srgb_code(-1.0f), 0);
  EXPECT_EQ(srgb_code(std::numeric_limits<float>::infinity()), 255);
  EXPECT_EQ(srgb_code(1.0f), 255);
}

TEST(DisplayCurveTest, slope_is_the_derivative) {
  for (const double x : {0.002, 0.05, 0.2, 0.8}) {
    const double d = (exact_srgb(x + 1e-5) - exact_srgb(x - 1e-5)) / 2e-5;
    EXPECT_NEAR(srgb_slope(srgb_code(static_cast<float>(x))) / d, 1.0, 0.05);
  }
}

TEST(DisplayCurveTest, planes_give_the_colours_back) {
  TileImage image{};
  for (std::size_t i = 0; i < kSlotTexels; ++i) {
    const std::size_t block = i / kSlotSize / 2 * 16 + i % kSlotSize / 2;  // 2x2 texels of one colour
    image.rgb[i * 3] = static_cast<std::uint8_t>(block * 37);
    image.rgb[i * 3 + 1] = static_cast<std::uint8_t>(block * 101);
    image.rgb[i * 3 + 2] = static_cast<std::uint8_t>(block * 7);
  }
  convert_to_planes(image);
  for (std::size_t i = 0; i < kSlotTexels; ++i) {
    const std::size_t chroma = i / kSlotSize / 2 * 16 + i % kSlotSize / 2;
    const double y = image.y[i];
    const double cb = image.cb[chroma] - 128.0;
    const double cr = image.cr[chroma] - 128.0;
    EXPECT_NEAR(y + 1.5748 * cr, image.rgb[i * 3], 2.0);
    EXPECT_NEAR(y - 0.187324 * cb - 0.468124 * cr, image.rgb[i * 3 + 1], 2.0);
    EXPECT_NEAR(y + 1.8556 * cb, image.rgb[i * 3 + 2], 2.0);
  }
}

}  // namespace
}  // namespace darm::renderer
