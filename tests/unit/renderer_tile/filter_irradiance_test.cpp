// The filter of soft light on windows made by hand.
#include "actors/renderer/filter_irradiance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace darm::renderer {
namespace {

constexpr float kTarget = 384;

// Window over the whole margin: each texel the mean of `samples` draws of `law(x, y, random)`.
using Law = std::function<float(int x, int y, std::mt19937&)>;
FilterWindow sampled(int samples, const Law& law, const std::function<std::uint32_t(int, int)>& patch) {
  FilterWindow w;
  w.reset(kMaxFilterRadius);
  std::mt19937 random(11);
  for (int y = 0; y < w.size; ++y)
    for (int x = 0; x < w.size; ++x) {
      const auto at = static_cast<std::size_t>(y * w.size + x);
      double sum = 0, squares = 0;
      for (int i = 0; i < samples; ++i) {
        const double v = law(x, y, random);
        sum += v;
        squares += v * v;
      }
      const double mean = sum / samples;
      w.patch[at] = patch(x, y);
      w.count[at] = static_cast<float>(samples);
      w.grey[at] = static_cast<float>(mean);
      w.grey_m2[at] = static_cast<float>(std::max(squares - mean * sum, 0.0));
      for (auto& channel : w.irradiance) channel[at] = w.grey[at];
      w.tint[at] = 0.25f;
    }
  return w;
}
std::uint32_t one_patch(int, int) { return 1; }

std::vector<FilteredTexel> filtered(const FilterWindow& w) {
  IrradianceFilter filter;
  std::vector<FilteredTexel> out;
  filter.run(w, kTarget, out);
  return out;
}

double rms_off(const FilterWindow& w, const std::vector<FilteredTexel>& out, double truth,
               const std::function<bool(int x, int y)>& counts) {
  double sum = 0;
  int n = 0;
  for (int y = 0; y < kSlotSize; ++y)
    for (int x = 0; x < kSlotSize; ++x) {
      const auto& t = out[static_cast<std::size_t>(y * kSlotSize + x)];
      const auto at = static_cast<std::size_t>((y + w.radius) * w.size + x + w.radius);
      if (!counts(x + w.radius, y + w.radius)) continue;
      sum += std::pow(double{t.known ? t.irradiance[1] : w.grey[at]} - truth, 2);
      ++n;
    }
  return std::sqrt(sum / n);
}
bool everywhere(int, int) { return true; }

float noisy(int, int, std::mt19937& random) { return std::uniform_real_distribution<float>(0.0f, 2.0f)(random); }
// Mean 1: one sample in 200 is 161, all others 0.2.
float rare(int, int, std::mt19937& random) {
  return std::uniform_real_distribution<float>(0.0f, 1.0f)(random) < 0.005f ? 160.2f : 0.2f;
}

TEST(IrradianceFilter, RareBrightLightStaysFilteredWhenOrdinaryLightNoLongerIs) {
  const int n = 1024;  // far past the target
  const auto ordinary = sampled(n, [](int, int, std::mt19937& r) { return 0.9f + 0.1f * noisy(0, 0, r); }, one_patch);
  for (const auto& t : filtered(ordinary)) ASSERT_FALSE(t.known);
  const auto bright = sampled(n, rare, one_patch);
  const auto out = filtered(bright);
  const double raw = rms_off(bright, std::vector<FilteredTexel>(kSlotTexels), 1, everywhere);
  EXPECT_LT(rms_off(bright, out, 1, everywhere), raw / 2.5);
}

TEST(IrradianceFilter, MoreSamplesNeverMakeItWorse) {
  double before = 1e30;
  for (const int n : {8, 32, 128, 512, 2048}) {
    const auto w = sampled(n, rare, one_patch);
    const double off = rms_off(w, filtered(w), 1, everywhere);
    EXPECT_LT(off, before) << n;
    before = off;
  }
}

TEST(IrradianceFilter, TheLimitIsWhatWasMeasured) {
  auto w = sampled(64, rare, one_patch);
  for (std::size_t i = 0; i < w.count.size(); ++i) {  // as many samples of the same law
    w.count[i] *= 65536;
    w.grey_m2[i] *= 65536;
  }
  for (const auto& t : filtered(w)) ASSERT_FALSE(t.known);
}

double mean_smear(const std::vector<FilteredTexel>& out, const std::function<bool(int x, int y)>& counts) {
  double sum = 0;
  int n = 0;
  for (int y = 0; y < kSlotSize; ++y)
    for (int x = 0; x < kSlotSize; ++x)
      if (counts(x + kMaxFilterRadius, y + kMaxFilterRadius)) {
        sum += double{out[static_cast<std::size_t>(y * kSlotSize + x)].smear};
        ++n;
      }
  return sum / n;
}

// Stripes of light eight texels wide, so faint that eight samples do not tell them from noise.
TEST(IrradianceFilter, SaysWhatItSmears) {
  const auto light = [](int x) { return x / 8 % 2 == 0 ? 0.9f : 1.1f; };
  const auto striped = sampled(8, [&](int x, int y, std::mt19937& r) { return light(x) * noisy(x, y, r); }, one_patch);
  const auto out = filtered(striped);
  double truth = 0;
  for (int i = 0; i < kSlotTexels; ++i) {
    const auto& t = out[static_cast<std::size_t>(i)];
    ASSERT_TRUE(t.known);
    truth +=
        std::pow(double{t.irradiance[1]} - double{light(i % kSlotSize + kMaxFilterRadius)}, 2) - double{t.variance};
  }
  truth /= kSlotTexels;
  EXPECT_GT(truth, 0.002);  // it does smear them
  const double said = mean_smear(out, everywhere);
  EXPECT_GT(said, truth / 2.5);
  EXPECT_LT(said, truth * 2);
}

TEST(IrradianceFilter, SaysItSmearsNothingWhereLightIsEven) {
  const auto out = filtered(sampled(8, noisy, one_patch));
  EXPECT_LT(std::abs(mean_smear(out, everywhere)), 0.001);  // noise of a texel's eight samples: 0.042
}

TEST(IrradianceFilter, SamplesThatAreLaidOutEvenlyAreLessNoise) {
  const auto random = sampled(8, noisy, one_patch);
  auto even = random;  // the same spread inside of texels, whose means lie four times nearer
  for (std::size_t i = 0; i < even.grey.size(); ++i) {
    even.grey[i] = 1 + (even.grey[i] - 1) / 4;
    for (auto& channel : even.irradiance) channel[i] = even.grey[i];
  }
  double of_random = 0, of_even = 0;
  for (const auto& t : filtered(random)) of_random += double{t.variance};
  for (const auto& t : filtered(even)) of_even += double{t.variance};
  EXPECT_NEAR(of_even / of_random, 1.0 / 16, 0.02);
}

TEST(IrradianceFilter, ADarkCornerIsNotBrightenedByWhatLiesInside) {
  // Light falls towards the border; a mean over one side would show the light two texels in.
  const auto light = [](int x) { return 0.4f + 0.06f * static_cast<float>(26 - x); };
  const auto w = sampled(
      64, [&](int x, int y, std::mt19937& r) { return light(x) * noisy(x, y, r); },
      [](int x, int) { return x < 26 ? 1u : 2u; });
  const auto out = filtered(w);
  double sum = 0;
  for (int y = 0; y < kSlotSize; ++y) {
    const auto& t = out[static_cast<std::size_t>(y * kSlotSize + 25 - w.radius)];
    ASSERT_TRUE(t.known);
    sum += double{t.irradiance[1]} - double{light(25)};
  }
  EXPECT_NEAR(sum / kSlotSize, 0.0, 0.02);
}

// Light of 1 on one side and of 20 on the other, noise of half of it, in one patch: at first nothing but the wall
// tells.
TEST(IrradianceFilter, NothingComesThroughAWall) {
  for (const bool across_rows : {true, false})
    for (const int samples : {1, 4}) {
      const auto behind = [&](int x, int y) { return (across_rows ? x : y) >= 23; };
      auto w = sampled(
          samples, [&](int x, int y, std::mt19937& r) { return (behind(x, y) ? 20.0f : 1.0f) * noisy(x, y, r); },
          one_patch);
      const auto near = [&](int x, int y) { return !behind(x, y) && behind(x + 3, y + 3); };
      const double open = rms_off(w, filtered(w), 1, near);
      for (int i = 0; i < w.size; ++i)
        w.walls[static_cast<std::size_t>(across_rows ? i * w.size + 23 : 23 * w.size + i)] =
            across_rows ? kWallBefore : kWallAbove;
      const double walled = rms_off(w, filtered(w), 1, near);
      EXPECT_LT(walled, 0.25) << samples;
      EXPECT_GT(open, 4 * walled) << samples;
    }
}

// A wall is no other patch: texels that are not parted by it are one's neighbours still.
TEST(IrradianceFilter, AWallThatEndsLeavesTheWayAroundItOpen) {
  auto w = sampled(1, noisy, one_patch);
  const auto free = filtered(w);
  for (int y = 0; y < w.size / 2; ++y) w.walls[static_cast<std::size_t>(y * w.size + 23)] = kWallBefore;
  const auto walled = filtered(w);
  const auto most_apart = [&](int first, int end) {
    float most = 0;
    for (int at = first * kSlotSize; at < end * kSlotSize; ++at)
      most = std::max(most, std::abs(free[static_cast<std::size_t>(at)].irradiance[0] -
                                     walled[static_cast<std::size_t>(at)].irradiance[0]));
    return most;
  };
  EXPECT_GT(most_apart(0, 12), 0.01f);
  EXPECT_LT(most_apart(28, kSlotSize), 0.003f);
}

}  // namespace
}  // namespace darm::renderer
