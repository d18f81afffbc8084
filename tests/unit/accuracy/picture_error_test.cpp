#include "daemon/accuracy/picture_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace darm::accuracy {
namespace {

constexpr std::uint32_t kSide = 200;

renderer::Picture flat(float value) {
  return {kSide, kSide, std::vector<glm::vec3>(std::size_t{kSide} * kSide, glm::vec3(value))};
}

// Noise of this standard deviation about a mid-grey, where the display curve is nearly straight.
renderer::Picture noisy(float value, float sigma, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(0.0f, sigma);
  auto picture = flat(value);
  for (auto& p : picture.pixels) p += normal(random);
  return picture;
}

const PixelMask kAll(std::size_t{kSide} * kSide, 1);

TEST(PictureError, TheNoiseOfTheHalvesDoesNotCount) {
  // On the display the picture is 188 / 255, the truth 0.7014: 28.9 dB. Against one noisy half it would be 28.3.
  const ShownHalves reference({noisy(0.45f, 0.02f, 1), noisy(0.45f, 0.02f, 2)});
  EXPECT_NEAR(psnr_to(flat(0.5f), reference, kAll), 28.9, 0.2);
}

TEST(PictureError, WhatIsNotCountedMayBeAnything) {
  auto picture = flat(0.5f);
  PixelMask mask = kAll;
  picture.pixels[7] = glm::vec3(100.0f);
  mask[7] = 0;
  const ShownHalves reference({flat(0.4f), flat(0.4f)});
  EXPECT_EQ(psnr_to(picture, reference, mask), psnr_to(flat(0.5f), reference, mask));
  EXPECT_DOUBLE_EQ(psnr_between(picture, flat(0.5f), mask), 100);
  EXPECT_LT(psnr_between(picture, flat(0.5f), kAll), 60);
  EXPECT_DOUBLE_EQ(counted_share(mask), 1 - 1.0 / (kSide * kSide));
  EXPECT_EQ(counted_share({}), 0);
}

TEST(PictureError, PicturesThatConvergeToTheSameAreApartByNoMoreThanTheStandardError) {
  // Fixed seeds: with normal errors more than 4 standard errors come once in 16,000.
  const auto d =
      difference({noisy(0.4f, 0.05f, 1), noisy(0.4f, 0.05f, 2)}, {noisy(0.4f, 0.05f, 3), noisy(0.4f, 0.05f, 4)}, kAll);
  EXPECT_GT(d.standard_error, 0);
  EXPECT_LT(std::abs(d.mse), 4 * d.standard_error);
}

TEST(PictureError, ARealDifferenceIsFoundUnderNoiseOfItsSize) {
  const auto d = difference({noisy(0.4f, 0.05f, 1), noisy(0.4f, 0.05f, 2)},
                            {noisy(0.45f, 0.05f, 3), noisy(0.45f, 0.05f, 4)}, kAll);
  const double truth = 0.7005 - 0.6651;
  EXPECT_NEAR(d.mse, truth * truth, 5 * d.standard_error + 5e-5);
  EXPECT_GT(d.mse, 10 * d.standard_error);
}

TEST(PictureError, NothingCountedIsNoError) {
  const ShownHalves reference({flat(0.4f), flat(0.4f)});
  EXPECT_DOUBLE_EQ(psnr_to(flat(0.5f), reference, PixelMask(kAll.size(), 0)), 100);
  EXPECT_EQ(difference({flat(0), flat(0)}, {flat(1), flat(1)}, PixelMask(kAll.size(), 0)).mse, 0);
}

}  // namespace
}  // namespace darm::accuracy
