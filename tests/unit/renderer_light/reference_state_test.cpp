#include "actors/renderer/reference_state.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace darm::renderer {
namespace {

constexpr std::uint32_t kSide = 128;
constexpr int kSamples = 16;  // in each quarter of each half

double shown(double linear) { return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055; }

// Light about white, as noisy as paths are: each sample is exponential, its spread as large as its mean.
struct Overexposed {
  Overexposed() : state(1, kSide, kSide) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> level(0.5f, 1.8f);
    std::exponential_distribution<float> path(1.0f);
    for (std::size_t pixel = 0; pixel < truth.size(); ++pixel) {
      truth[pixel] = level(random);
      for (auto& half : state.halves)
        for (std::size_t q = pixel * kQuarters; q < (pixel + 1) * kQuarters; ++q)
          for (int i = 0; i < kSamples; ++i)
            half[q].add(truth[pixel] * glm::vec3(path(random), path(random), path(random)));
    }
  }
  ReferenceState state;
  std::vector<float> truth = std::vector<float>(std::size_t{kSide} * kSide);
};

// Standard error of the mean 6e-6. What is left (5e-5, 43 dB) is the samples' skewness and the curve's bend; halves
// that are clamped by themselves leave 3e-4 (35 dB), which is more than a good picture is from its reference.
TEST(ReferenceState, noise_of_overexposed_light_cancels_between_the_halves) {
  const Overexposed light;
  const Picture a = light.state.picture(0), b = light.state.picture(1);
  double sum = 0;
  for (std::size_t i = 0; i < light.truth.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const double right = shown(std::min(double{light.truth[i]}, 1.0));
      sum += (right - shown(double{a.pixels[i][c]})) * (right - shown(double{b.pixels[i][c]}));
    }
  EXPECT_NEAR(sum / (3.0 * static_cast<double>(light.truth.size())), 0, 1e-4);
}

TEST(ReferenceState, the_mean_is_display_referred_and_lies_between_the_halves) {
  const Overexposed light;
  const Picture mean = light.state.picture(2), a = light.state.picture(0), b = light.state.picture(1);
  for (std::size_t i = 0; i < mean.pixels.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      ASSERT_LE(mean.pixels[i][c], 1.0f);
      ASSERT_NEAR(mean.pixels[i][c], 0.5f * (a.pixels[i][c] + b.pixels[i][c]), 1e-5f);
    }
}

// Half the picture is white for certain; in the other half one sample in two is four times white, and what it brings
// is cut: 1 of every 1 + 1 + 1 (that half's light, its cut, the certain half's).
TEST(ReferenceState, light_that_is_cut_without_agreement_is_told) {
  ReferenceState state(1, 2, 1);
  for (std::size_t q = 0; q < kQuarters; ++q) {
    state.halves[0][q].add(glm::vec3(3.0f));
    state.halves[1][q].add(glm::vec3(2.0f));
    state.halves[0][kQuarters + q].add(glm::vec3(4.0f));
    state.halves[1][kQuarters + q].add(glm::vec3(0.0f));
  }
  EXPECT_NEAR(state.doubtful_cut(), 1.0 / 3.0, 1e-6);
  EXPECT_EQ(ReferenceState(1, 2, 1).doubtful_cut(), 0.0);
}

}  // namespace
}  // namespace darm::renderer
