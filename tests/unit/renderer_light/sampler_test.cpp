#include "actors/renderer/sampler.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "actors/renderer/bsdf.hpp"
#include "actors/renderer/sampling.hpp"

namespace darm::renderer {
namespace {

// Chi-square of counts against expected shares; true if it stays under the 1 - 1e-6 quantile (Wilson & Hilferty).
bool fits(const std::vector<double>& counts, const std::vector<double>& expected) {
  double chi2 = 0;
  int freedom = -1;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (expected[i] < 5) continue;
    chi2 += (counts[i] - expected[i]) * (counts[i] - expected[i]) / expected[i];
    ++freedom;
  }
  const double a = 2.0 / (9.0 * freedom);
  return chi2 < freedom * std::pow(1 - a + 4.753 * std::sqrt(a), 3);
}

glm::vec2 hashed(std::uint32_t i) {  // independent points, as the test demands
  Sampler s(99, i, 0);
  return s.next_2d();
}

TEST(Sampler, equal_arguments_give_equal_numbers_and_others_do_not) {
  Sampler a(1, 2, 3), b(1, 2, 3), c(2, 2, 3), d(1, 3, 3), e(1, 2, 4);
  const auto x = a.next_2d();
  EXPECT_EQ(x, b.next_2d());
  EXPECT_NE(x, c.next_2d());
  EXPECT_NE(x, d.next_2d());
  EXPECT_NE(x, e.next_2d());
}

TEST(Sampler, numbers_lie_in_the_half_open_unit_interval_in_every_dimension) {
  for (std::uint32_t i = 0; i < 2000; ++i) {
    Sampler s(7, i * 31, i);
    for (int d = 0; d < 60; ++d) {
      const auto p = s.next_2d();
      const float q = s.next_1d();
      ASSERT_TRUE(p.x >= 0 && p.x < 1 && p.y >= 0 && p.y < 1 && q >= 0 && q < 1);
    }
  }
}

TEST(Sampler, first_samples_of_a_pixel_are_stratified_as_a_0_2_net) {
  for (std::uint32_t pixel = 0; pixel < 20; ++pixel)
    for (int draw = 0; draw < 8; ++draw)
      for (const int columns : {1, 2, 4, 8, 16}) {
        std::vector<int> cells(16, 0);
        for (std::uint32_t i = 0; i < 16; ++i) {
          Sampler s(5, pixel, i);
          for (int skip = 0; skip < draw; ++skip) (void)s.next_2d();
          const auto p = s.next_2d();
          const int rows = 16 / columns;
          ++cells[static_cast<std::size_t>(static_cast<int>(p.x * static_cast<float>(columns)) * rows +
                                           static_cast<int>(p.y * static_cast<float>(rows)))];
        }
        for (const int n : cells) ASSERT_EQ(n, 1) << "pixel " << pixel << " draw " << draw;
      }
}

TEST(Sampler, pixels_and_draws_are_independent) {
  for (const int draw : {0, 1, 5, 31, 32, 40}) {
    std::vector<double> counts(256, 0);
    const std::uint32_t n = 100000;
    for (std::uint32_t i = 0; i < n; ++i) {
      Sampler s(11, i, 0);
      for (int skip = 0; skip < draw; ++skip) (void)s.next_1d();
      const float a = s.next_1d();
      const float b = s.next_1d();
      ++counts[static_cast<std::size_t>(a * 16) * 16 + static_cast<std::size_t>(b * 16)];
    }
    EXPECT_TRUE(fits(counts, std::vector<double>(256, n / 256.0))) << "draw " << draw;
  }
}

TEST(Sampling, cosine_cap_and_triangle_samples_have_their_densities) {
  const std::uint32_t n = 200000;
  std::vector<double> cosine(20, 0), cap(20, 0), triangle(16, 0);
  for (std::uint32_t i = 0; i < n; ++i) {
    const auto xi = hashed(i);
    const auto d = sample_cosine(xi);
    ++cosine[std::min<std::size_t>(19, static_cast<std::size_t>(d.z * d.z * 20))];  // z^2 is uniform
    const auto c = sample_cap(xi, 0.5f);
    ++cap[std::min<std::size_t>(19, static_cast<std::size_t>((1 - c.z) / 0.25f * 20))];  // height is uniform
    const auto t = sample_triangle(xi);
    EXPECT_LE(t.x + t.y, 1.00001f);
    // Four similar quarters of the triangle, and of each again four.
    const auto quarter = [](glm::vec2& p) -> std::size_t {
      p *= 2.0f;
      if (p.x >= 1) return p.x -= 1, 1u;
      if (p.y >= 1) return p.y -= 1, 2u;
      if (p.x + p.y < 1) return 0u;
      p = glm::vec2(1 - p.x, 1 - p.y);
      return 3u;
    };
    glm::vec2 p = t;
    const auto first = quarter(p);
    ++triangle[first * 4 + quarter(p)];
  }
  EXPECT_TRUE(fits(cosine, std::vector<double>(20, n / 20.0)));
  EXPECT_TRUE(fits(cap, std::vector<double>(20, n / 20.0)));
  EXPECT_TRUE(fits(triangle, std::vector<double>(16, n / 16.0)));
}

TEST(Sampling, an_alias_table_draws_by_weight_and_never_what_weighs_nothing) {
  const std::vector<double> weights{1, 0, 5, 2.5, 0, 100, 0.25};
  const AliasTable table(weights);
  std::vector<double> counts(weights.size(), 0), expected;
  double sum = 0;
  for (const double w : weights) sum += w;
  const std::uint32_t n = 200000;
  for (const double w : weights) expected.push_back(n * w / sum);
  for (std::uint32_t i = 0; i < n; ++i) {
    float xi = hashed(i).x;
    ++counts[table.draw(xi)];
    ASSERT_TRUE(xi >= 0 && xi < 1);
  }
  EXPECT_EQ(counts[1] + counts[4], 0);
  EXPECT_TRUE(fits(counts, expected));
  EXPECT_TRUE(AliasTable({0, 0}).empty());
}

struct Case {
  const char* name;
  float roughness, metallic, transmission, thickness;
  bool front;
};

class BsdfCases : public ::testing::TestWithParam<Case> {
 protected:
  static trace::Surface surface(bool front) {
    trace::Surface s;
    s.front = front;
    return s;
  }
  static MaterialPoint material(const Case& c) {
    MaterialPoint m;
    m.base = glm::vec3(1);
    m.metallic = c.metallic;
    m.ggx_alpha = std::max(c.roughness * c.roughness, kSmallestAlpha);
    m.transmission = c.transmission;
    m.thin = c.thickness <= 0;
    return m;
  }
};

// Directions drawn fall where the density says they do: 16 x 32 cells over the sphere, 2e5 draws, quantile 1 - 1e-6.
TEST_P(BsdfCases, samples_follow_their_density) {
  const Case c = GetParam();
  if (c.roughness < 0.2f) GTEST_SKIP() << "lobes narrower than a cell: integration of the density is too coarse";
  const Bsdf bsdf(surface(c.front), material(c), glm::normalize(glm::vec3(0.5f, 0.2f, 0.8f)));
  constexpr int kRows = 16, kColumns = 32, kFine = 16;
  const std::uint32_t n = 200000;
  std::vector<double> counts(kRows * kColumns, 0), expected(kRows * kColumns, 0);
  for (std::uint32_t i = 0; i < n; ++i) {
    Sampler s(3, i, 0);
    const auto made = bsdf.sample(s);
    if (!(made.pdf > 0)) continue;
    const float phi = std::atan2(made.direction.y, made.direction.x) / (2 * kPi) + 0.5f;
    const auto row = std::min(kRows - 1, static_cast<int>((made.direction.z * 0.5f + 0.5f) * kRows));
    const auto column = std::min(kColumns - 1, static_cast<int>(phi * kColumns));
    ++counts[static_cast<std::size_t>(row * kColumns + column)];
  }
  for (int y = 0; y < kRows * kFine; ++y)
    for (int x = 0; x < kColumns * kFine; ++x) {
      const float z = (static_cast<float>(y) + 0.5f) / (kRows * kFine) * 2 - 1;
      const float phi = ((static_cast<float>(x) + 0.5f) / (kColumns * kFine) - 0.5f) * 2 * kPi;
      const float r = std::sqrt(1 - z * z);
      float pdf = 0;
      (void)bsdf.evaluate({r * std::cos(phi), r * std::sin(phi), z}, pdf);
      const double area = 4 * M_PI / (kRows * kFine) / (kColumns * kFine);
      expected[static_cast<std::size_t>(y / kFine * kColumns + x / kFine)] += n * pdf * area;
    }
  EXPECT_TRUE(fits(counts, expected));
}

// In a white furnace nothing gains energy, and sampling agrees with integrating f cos over the sphere.
TEST_P(BsdfCases, white_furnace_gains_nothing_and_equals_the_numeric_albedo) {
  const Case c = GetParam();
  for (const float cosine : {0.15f, 0.5f, 0.95f}) {
    const Bsdf bsdf(surface(c.front), material(c), {std::sqrt(1 - cosine * cosine), 0, cosine});
    double sampled = 0, uniform = 0, square = 0;
    const std::uint32_t n = 40000;
    for (std::uint32_t i = 0; i < n; ++i) {
      Sampler s(4, 1, i);
      const double w = static_cast<double>(bsdf.sample(s).weight.x);
      sampled += w / n;
      square += w * w / n;
    }
    const double error = 5 * std::sqrt(std::max(0.0, square - sampled * sampled) / n) + 1e-4;
    EXPECT_LE(sampled, 1 + error) << c.name << " at " << cosine;
    EXPECT_GT(sampled, 0.3) << c.name << " at " << cosine;
    if (c.roughness < 0.3f) continue;
    const std::uint32_t m = 100000;
    double spread = 0;
    for (std::uint32_t i = 0; i < m; ++i) {
      const auto xi = hashed(i);
      const float z = 1 - 2 * xi.x, r = std::sqrt(std::max(0.0f, 1 - z * z));
      float pdf = 0;
      const double f =
          4 * M_PI *
          static_cast<double>(bsdf.evaluate({r * std::cos(2 * kPi * xi.y), r * std::sin(2 * kPi * xi.y), z}, pdf).x);
      uniform += f / m;
      spread += f * f / m;
    }
    EXPECT_NEAR(sampled, uniform, error + 5 * std::sqrt(spread / m)) << c.name << " at " << cosine;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Materials, BsdfCases,
    ::testing::Values(Case{"plastic_rough", 1, 0, 0, 0, true}, Case{"plastic", 0.5f, 0, 0, 0, true},
                      Case{"plastic_smooth", 0.05f, 0, 0, 0, true}, Case{"metal_rough", 1, 1, 0, 0, true},
                      Case{"metal", 0.5f, 1, 0, 0, true}, Case{"mirror", 0, 1, 0, 0, true},
                      Case{"half_metal", 0.4f, 0.5f, 0, 0, true}, Case{"frosted_pane", 0.5f, 0, 0.8f, 0, true},
                      Case{"frosted_body", 0.5f, 0, 1, 1, true}, Case{"frosted_body_from_inside", 0.5f, 0, 1, 1, false},
                      Case{"glass_body", 0, 0, 1, 1, true}, Case{"glass_body_from_inside", 0, 0, 1, 1, false}),
    [](const auto& i) { return i.param.name; });

}  // namespace
}  // namespace darm::renderer
