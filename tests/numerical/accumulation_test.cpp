// Running means and spreads against the same sums in long double, from the store's merges to the picture's bound on
// fireflies.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>
#include <vector>

#include "actors/atlas/radiance_store.hpp"
#include "actors/renderer/lost_light.hpp"
#include "actors/renderer/outliers.hpp"
#include "actors/renderer/texel_shading.hpp"
#include "tests/numerical/worst.hpp"
#include "tests/unit/renderer_tile/made_up_surface.hpp"

namespace darm::numerical {
namespace {

using atlas::Layer;
using atlas::RadianceStore;
using atlas::TexelBatch;

/// Mean and sum of squared deviations of the luminance, as the samples have them.
struct Truth {
  long double mean = 0;
  long double m2 = 0;
};

Truth truth_of(const std::vector<glm::vec3>& samples) {
  Truth t;
  const auto grey = [](const glm::vec3& s) { return static_cast<long double>(atlas::luminance(glm::dvec3(s))); };
  for (const auto& s : samples) t.mean += grey(s);
  t.mean /= static_cast<long double>(samples.size());
  for (const auto& s : samples) t.m2 += (grey(s) - t.mean) * (grey(s) - t.mean);
  return t;
}

class Accumulation : public ::testing::Test {
 protected:
  Accumulation() {
    folder_ = std::filesystem::temp_directory_path() / ("darm_numerical_" + std::to_string(::getpid()));
    store_ = RadianceStore::open(folder_, {}, std::vector<std::uint32_t>{9}).value();
  }
  ~Accumulation() override {
    store_.reset();
    std::filesystem::remove_all(folder_);
  }

  /// Merges samples into a fresh texel in groups; returns the stored mean luminance and second moment.
  Truth merged(const std::vector<glm::vec3>& samples, std::size_t group) {
    const int texel = next_++ % kTileTexels;
    auto update = store_->begin_update(TileId(0, static_cast<std::uint32_t>((next_ - 1) / kTileTexels))).value();
    for (std::size_t at = 0; at < samples.size(); at += group) {
      TexelBatch batch;
      for (std::size_t i = at; i < std::min(samples.size(), at + group); ++i) EXPECT_TRUE(batch.add(samples[i]));
      update.merge(texel, Layer::kSoft, batch);
    }
    const float n = update.view().count(Layer::kSoft, texel);
    EXPECT_EQ(n, static_cast<float>(samples.size()));
    const double variance = update.view().variance_of_mean(Layer::kSoft, texel, 0);
    return {static_cast<long double>(atlas::luminance(glm::dvec3(update.view().mean(Layer::kSoft, texel)))),
            static_cast<long double>(variance * n * (n - 1))};
  }

  std::filesystem::path folder_;
  std::unique_ptr<RadianceStore> store_;
  int next_ = 0;
};

double relative(long double got, long double truth) { return static_cast<double>(std::abs(got / truth - 1)); }

TEST_F(Accumulation, a_hundred_million_equal_samples_stay_exact) {
  Worst off("constant: channels whose mean moved", 0);
  Worst spread("constant: spread made up by rounding, standard error over mean", 1e-6);
  auto update = store_->begin_update(TileId(0, 0)).value();
  const glm::vec3 value(0.1f, 1234.567f, 3e-7f);
  TexelBatch batch;
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(batch.add(value));
  for (int i = 0; i < scaled(1'000'000); ++i) update.merge(5, Layer::kSharp, batch);
  for (int c = 0; c < 3; ++c) off.see(update.view().mean(Layer::kSharp, 5)[c] == value[c] ? 0 : 1, "channel", c);
  const double variance = update.view().variance_of_mean(Layer::kSharp, 5, 1e9f);
  spread.see(std::sqrt(variance) / atlas::luminance(glm::dvec3(value)));
}

// Two values of blue, a rounding step apart: the least variance that float samples of a million can have.
TEST_F(Accumulation, a_batch_keeps_a_variance_of_a_millionth_beside_a_mean_of_a_million) {
  Worst off("batch: variance 1e-6 at mean 1e6, relative error", 1e-3);
  std::mt19937 random(1);
  for (const int n : {2, 64, 4096, 65536}) {
    std::vector<glm::vec3> samples;
    for (int i = 0; i < n; ++i)
      samples.emplace_back(1e6f, 1e6f, std::nextafter(1e6f, i == 1 || random() % 20 == 0 ? 2e6f : 1e6f));
    TexelBatch batch;
    for (const auto& s : samples) ASSERT_TRUE(batch.add(s));
    const Truth truth = truth_of(samples);
    ASSERT_LT(truth.m2 / n, n == 2 ? 6e-6L : 3e-6L);
    off.see(relative(static_cast<long double>(batch.luminance_m2), truth.m2), "samples", n);
  }
}

// Where each merge rounds the mean to float, a variance of 1 beside a mean of 1e6 (16 steps a unit) is the limit.
TEST_F(Accumulation, the_store_keeps_a_variance_of_one_beside_a_mean_of_a_million) {
  Worst spread("store: variance 1 at mean 1e6, relative error", 0.02);
  Worst mean("store: mean 1e6, error in steps of a float", 4);
  std::mt19937 random(2);
  std::normal_distribution<float> light(1e6f, 1.0f);
  std::vector<glm::vec3> samples;
  for (int i = 0; i < scaled(65536); ++i) samples.emplace_back(light(random));
  const Truth truth = truth_of(samples);
  for (const std::size_t group : {1u, 4u, 64u, 4096u}) {
    const Truth got = merged(samples, group);
    spread.see(relative(got.m2, truth.m2), "groups of", group);
    mean.see(static_cast<double>(std::abs(got.mean - truth.mean)) / 0.0625, "groups of", group);
  }
}

// A float mean of n merges no longer moves for samples nearer than n / 2^24 of itself. Skewed noise shows it most: many
// samples a little too dark, which it ignores, and rare bright ones, which it does not.
TEST_F(Accumulation, skewed_noise_biases_the_mean_by_less_than_merges_over_two_to_the_24) {
  Worst off("skewed noise: relative error over merges / 2^24", 1);
  std::mt19937 random(5);
  for (const float dark : {0.9999f, 0.999f, 0.99f})
    for (const std::size_t group : {1u, 16u}) {
      std::vector<glm::vec3> samples;
      for (int i = 0; i < scaled(65536); ++i)
        samples.emplace_back(random() % 1000 == 0 ? 1.0f + 1000 * (1 - dark) : dark);
      const double merges = static_cast<double>(samples.size() / group);
      off.see(relative(merged(samples, group).mean, truth_of(samples).mean) / (merges / 16777216.0 + 1e-6), "dark",
              dark, "groups of", group);
    }
}

// A lone bright sample must neither be lost nor stay, wherever in the sequence it comes.
TEST_F(Accumulation, one_bright_sample_among_ten_million_counts_once) {
  Worst off("bright sample: mean, relative error", 2e-3);
  Worst spread("bright sample: standard error, relative error", 2e-2);
  const auto look = [&](std::size_t n, std::size_t group, std::size_t bright_at) {
    auto update = store_->begin_update(TileId(0, 1)).value();
    const int texel = next_++;
    TexelBatch plain, lit;
    for (std::size_t i = 0; i < group; ++i) {
      ASSERT_TRUE(plain.add(glm::vec3(1)));
      ASSERT_TRUE(lit.add(glm::vec3(i == 0 ? 1e6f : 1.0f)));
    }
    for (std::size_t at = 0; at < n; at += group)
      update.merge(texel, Layer::kSoft, at / group == bright_at / group ? lit : plain);
    const double count = static_cast<double>(n);
    const double mean = 1 + (1e6 - 1) / count;
    const double error = (1e6 - 1) / count;  // sqrt((b - 1)^2 (1 - 1/n) / (n - 1) / n)
    const double got = update.view().mean(Layer::kSoft, texel).y;
    off.see(std::abs(got / mean - 1), "of", n, "in groups of", group, "at", bright_at, "got", got, "truth", mean);
    const double got_error = std::sqrt(double{update.view().variance_of_mean(Layer::kSoft, texel, 0)});
    spread.see(std::abs(got_error / error - 1), "of", n, "in groups of", group, "at", bright_at);
  };
  for (const double place : {0.0, 0.01, 0.5, 0.999999}) {
    // As the daemon shades: up to 65536 samples a texel, in the worst case one by one.
    look(65536, 1, static_cast<std::size_t>(65536 * place));
    look(10'000'000, 100, static_cast<std::size_t>(1e7 * place));
  }
}

TEST_F(Accumulation, any_order_and_grouping_merge_to_the_same_mean_and_spread) {
  Worst mean("merging: mean, relative error", 2e-5);
  Worst spread("merging: second moment, relative error", 1e-4);
  std::mt19937 random(3);
  std::lognormal_distribution<float> light(0.0f, 2.5f);
  std::vector<glm::vec3> samples;
  for (int i = 0; i < scaled(20000); ++i) samples.emplace_back(light(random), light(random), light(random));
  const Truth truth = truth_of(samples);
  const auto darker = [](const glm::vec3& a, const glm::vec3& b) { return a.x + a.y + a.z < b.x + b.y + b.z; };
  for (const char* order : {"as drawn", "ascending", "descending", "shuffled"}) {
    if (order[0] == 'a' && order[1] == 's' && order[2] == 'c') std::ranges::sort(samples, darker);
    if (order[0] == 'd') std::ranges::reverse(samples);
    if (order[0] == 's') std::ranges::shuffle(samples, random);
    for (const std::size_t group : {1u, 3u, 64u, 1000u, 1000000u}) {
      const Truth got = merged(samples, group);
      mean.see(relative(got.mean, truth.mean), order, "groups of", group);
      spread.see(relative(got.m2, truth.m2), order, "groups of", group);
    }
  }
}

// Every kind of number that is no light, in either layer: counted, replaced by another sample, never stored.
TEST_F(Accumulation, what_is_no_light_is_counted_and_never_stored) {
  Worst count("quarantine: samples miscounted", 0);
  Worst stored("quarantine: texels whose mean is not that of the good samples", 0);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const float bad[] = {nan, -nan, inf, -inf, 3e38f, -3e38f, std::numeric_limits<float>::signaling_NaN()};
  for (const float value : bad)
    for (const bool sharp : {false, true})
      for (const int channel : {0, 1, 2}) {
        renderer::MadeUpWorld world;
        world.world.albedo = [](TileId, int, int) { return glm::vec3(1.0f); };
        const auto is_bad = [](int texel, std::uint32_t sample) {
          const bool always = texel % 7 == 0;  // its second try fails as well
          return always || (sample < 0x80000000u && (texel + static_cast<int>(sample)) % 5 == 0);
        };
        world.world.light = [&](TileId, int texel, std::uint32_t sample) {
          renderer::TexelLight light{glm::vec3(0.25f), glm::vec3(0.5f)};
          if (is_bad(texel, sample)) (sharp ? light.sharp : light.soft)[channel] = value;
          return light;
        };
        std::uint32_t expected = 0;
        (sharp ? world.world.sharp_asked : world.world.soft_asked) = [&](TileId, int texel, std::uint32_t sample) {
          expected += sample < 0x80000000u && is_bad(texel, sample) ? 1 : 0;
        };
        const TileId tile(0, static_cast<std::uint32_t>(next_++ % 9));
        const auto surface = world.tile(tile);
        std::uint32_t quarantined = 0;
        const auto start = renderer::survey_tile(*store_, tile, TexelMask::all(), *surface).least;
        for (const std::uint32_t passes : {1u, 4u})  // a first pass where the tile is new, then soft light for all
          quarantined += renderer::shade_tile(*store_, tile, TexelMask::all(), passes, *surface).value().quarantined;
        count.see(std::abs(static_cast<double>(quarantined) - expected), "value", value);
        const auto view = store_->read(tile);
        ASSERT_TRUE(view);
        for (int t = 0; t < kTileTexels; ++t) {
          // A texel that always fails is black in the layer that fails. Tiles come more than once, with other faults.
          const float share = t % 7 == 0 ? 0.0f : 1.0f;
          const bool fresh = start == 0;
          const glm::vec3 seen = sharp ? view->mean(Layer::kSharp, t) : view->mean(Layer::kSoft, t);
          const glm::vec3 truth((sharp ? 0.25f : 0.5f) * share);
          const bool right = (fresh ? seen == truth : share == 0 || seen == truth) && view->count(Layer::kSoft, t) >= 4;
          stored.see(right ? 0 : 1, "value", value, "texel", t);
        }
      }
}

// The picture's bound on lone bright texels: exactly 2 + 24 / n + n / 64 times the neighbours' mean, nothing from 1024
// samples on. The store has no part in it.
TEST(Fireflies, are_held_to_the_stated_bound) {
  Worst off("fireflies: brightness off the stated one, relative", 2e-5);
  std::mt19937 random(4);
  std::lognormal_distribution<float> light(0.0f, 2.0f);
  for (const float samples : {1.0f, 4.0f, 32.0f, 255.0f, 1023.0f, 1024.0f, 4096.0f}) {
    renderer::LightSquare square;
    square.reset(40);
    const int size = square.size;
    const auto patch_of = [](int x) { return x < 20 ? 0u : 1u; };
    for (std::size_t at = 0; at < square.count.size(); ++at) {
      square.patch[at] = patch_of(static_cast<int>(at) % size);
      square.count[at] = samples;
      square.grey[at] = light(random);
    }
    std::vector<renderer::Outlier> found;
    find_outliers(square, found);
    std::vector<double> held(square.grey.begin(), square.grey.end());
    for (const auto& outlier : found) held[outlier.at] *= double{outlier.scale};
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x) {
        double sum = 0;
        int n = 0;
        for (int v = std::max(0, y - 2); v <= std::min(size - 1, y + 2); ++v)
          for (int u = std::max(0, x - 2); u <= std::min(size - 1, x + 2); ++u) {
            if ((u == x && v == y) || patch_of(u) != patch_of(x)) continue;
            sum += double{square.grey[static_cast<std::size_t>(v * size + u)]};
            ++n;
          }
        const auto at = static_cast<std::size_t>(y * size + x);
        double stated = double{square.grey[at]};
        if (samples < 1024) stated = std::min(stated, (2 + 24 / double{samples} + double{samples} / 64) * sum / n);
        off.see(std::abs(held[at] / stated - 1), "samples", samples);
      }
  }
}

// What is taken from a patch goes to its other texels, smoothly: over a surface of many tiles, of which each is drawn
// by what it and its eight neighbours lost, the sum stays. Every tile loses something else; most of it is trusted. One
// that closes on itself, so that it has no ends.
TEST(Fireflies, are_shared_out_so_that_the_light_of_a_patch_stays) {
  Worst off("fireflies: light of a patch off what it was, relative", 2e-6);
  constexpr int kAround = 5;  // tiles
  std::mt19937 random(5);
  std::lognormal_distribution<float> light(0.0f, 1.0f);
  renderer::LightSquare nine;
  nine.reset(3 * kTileSize);
  nine.patch.assign(nine.patch.size(), 1);
  nine.count.assign(nine.count.size(), 4.0f);
  nine.grey.assign(nine.grey.size(), 5.0f);  // more than is lost: all of it is trusted
  std::array<std::vector<float>, kAround * kAround> taken;
  double sum = 0;
  for (auto& tile : taken)
    for (int n = 0; n < 100; ++n) sum += double{tile.emplace_back(light(random))};
  double given = 0;
  for (int row = 0; row < kAround; ++row)
    for (int column = 0; column < kAround; ++column) {
      renderer::LostLight lost;
      for (int d = 0; d < 9; ++d) {
        const int y = (row + d / 3 - 1 + kAround) % kAround, x = (column + d % 3 - 1 + kAround) % kAround;
        for (const float grey : taken[static_cast<std::size_t>(y * kAround + x)])
          lost.take(d, 1, glm::vec3(grey), grey);
      }
      lost.measure(nine);
      for (int y = 1; y <= kTileSize; ++y)
        for (int x = 1; x <= kTileSize; ++x) given += double{lost.at(1, x, y).irradiance.y};
    }
  off.see(std::abs(given / sum - 1), "tiles", kAround * kAround);
}

}  // namespace
}  // namespace darm::numerical
