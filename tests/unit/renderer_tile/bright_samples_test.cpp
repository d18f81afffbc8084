#include "actors/renderer/bright_samples.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace darm::renderer {
namespace {

double error_with(const std::vector<BrightMeasure>& texels, double least) {
  double square = 0, flux = 0;
  for (const auto& t : texels) {
    square += double{t.deviation} * double{t.deviation} / std::max(double{t.samples}, least);
    flux += double{t.flux};
  }
  return std::sqrt(square) / flux;
}

TEST(BrightSamples, BringTheirFluxToTheTolerance) {
  const std::vector<BrightMeasure> texels(40, {2.0f, 3.0f, 16.0f});
  const std::uint32_t wanted = bright_samples(texels, 0.01f);
  EXPECT_GT(wanted, 16u);
  EXPECT_LE(error_with(texels, wanted), 0.01);
  EXPECT_GT(error_with(texels, wanted / 4.0), 0.01) << "and no further";
}

TEST(BrightSamples, AskForNothingThatIsThere) {
  EXPECT_EQ(bright_samples(std::vector<BrightMeasure>(40, {2.0f, 3.0f, 4096.0f}), 0.01f), 0u);
  EXPECT_EQ(bright_samples(std::vector<BrightMeasure>(40, {2.0f, 0.0f, 1.0f}), 0.01f), 0u) << "sharp light";
  EXPECT_EQ(bright_samples({}, 0.01f), 0u);
  EXPECT_EQ(bright_samples(std::vector<BrightMeasure>(3, {0.0f, 1.0f, 1.0f}), 0.01f), 0u) << "no flux, no share of it";
}

// Each round of asking and getting must end, whatever the measures: else the renderer does nothing else.
TEST(BrightSamples, AskingComesToAnEnd) {
  for (const std::size_t n : {1u, 7u, 300u, 5000u, 100000u}) {
    std::vector<BrightMeasure> texels;
    for (std::size_t i = 0; i < n; ++i)
      texels.push_back(
          {1.0f + static_cast<float>(i % 7), 1000.0f / (1.0f + static_cast<float>(i % 13)), static_cast<float>(i % 5)});
    int rounds = 0;
    double taken = 0;
    while (const std::uint32_t wanted = bright_samples(texels, 0.005f)) {
      ASSERT_LT(++rounds, 20) << n;
      for (auto& t : texels) {
        taken += std::max(static_cast<double>(wanted) - double{t.samples}, 0.0);
        t.samples = std::max(t.samples, static_cast<float>(wanted));
      }
    }
    EXPECT_LE(taken, 2 * kSamplesOfBright + static_cast<double>(n)) << n;
  }
}

}  // namespace
}  // namespace darm::renderer
