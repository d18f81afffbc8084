// Every routine that draws directions, points or lights against the density it claims, by chi-square. (Bsdf::sample has
// its own in tests/unit/renderer_light.)
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>

#include "actors/renderer/bright_texels.hpp"
#include "actors/renderer/light_set.hpp"
#include "actors/renderer/sampling.hpp"
#include "tests/numerical/statistics.hpp"
#include "tests/numerical/worst.hpp"
#include "tests/unit/renderer_light/lit_room.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::numerical {
namespace {

using namespace darm::renderer;  // NOLINT(google-build-using-namespace): the room under test
using test::HandScene;

constexpr std::uint64_t kSeed = 404;

std::size_t cell(double x, std::size_t cells) {
  return std::min(cells - 1, static_cast<std::size_t>(std::max(0.0, x) * static_cast<double>(cells)));
}
double turn_of(double x, double y) { return std::atan2(y, x) / (2 * M_PI) + 0.5; }

/// Counts of `draws` points that `map` brings back to the unit square, where they must be even.
template <class Map>
double deviate_from_even(std::uint32_t draws, std::uint64_t seed, const Map& map) {
  constexpr std::size_t kSide = 16;
  std::vector<double> counts(kSide * kSide, 0);
  for (std::uint32_t i = 0; i < draws; ++i) {
    const glm::dvec2 p = map(independent_point(seed, i));
    ++counts[cell(p.x, kSide) * kSide + cell(p.y, kSide)];
  }
  return chi_deviate(counts, std::vector<double>(kSide * kSide, draws / double{kSide * kSide}));
}

TEST(Sampling, discs_cosines_and_caps_are_even_over_their_shapes) {
  Worst off("chi-square of disc, cosine and cap: normal deviate", kChiDeviate);
  const std::uint32_t n = scaled(200000u);
  off.see(deviate_from_even(n, kSeed,
                            [](glm::vec2 xi) {
                              const glm::dvec2 d(sample_disc(xi));
                              return glm::dvec2(glm::dot(d, d), turn_of(d.x, d.y));
                            }),
          "disc");
  off.see(deviate_from_even(n, kSeed + 1,
                            [](glm::vec2 xi) {
                              const glm::dvec3 d(sample_cosine(xi));
                              return glm::dvec2(d.z * d.z, turn_of(d.x, d.y));
                            }),
          "cosine");
  for (const float chord2 : {1e-9f, 2.1e-5f, 0.5f, 1.9f, 3.9f})  // the sun is the second
    off.see(deviate_from_even(n, kSeed + 2,
                              [&](glm::vec2 xi) {
                                const glm::dvec3 d(sample_cap(xi, chord2));
                                const double r2 = d.x * d.x + d.y * d.y;
                                const double root = std::sqrt(std::max(0.0, 1 - r2));
                                // 1 - z without cancellation: a small cap's z is 1 in float.
                                const double height = d.z > 0.5 ? r2 / (1 + root) : 1 - d.z;
                                return glm::dvec2(height / (0.5 * double{chord2}), turn_of(d.x, d.y));
                              }),
            "cap", chord2);
}

/// Which of the 4^levels similar triangles holds the point.
std::size_t quarter_of(glm::dvec2 p, int levels) {
  std::size_t index = 0;
  for (int i = 0; i < levels; ++i) {
    p *= 2.0;
    std::size_t q = 0;
    if (p.x >= 1) {
      p.x -= 1, q = 1;
    } else if (p.y >= 1) {
      p.y -= 1, q = 2;
    } else if (p.x + p.y >= 1) {
      p = glm::dvec2(1 - p.x, 1 - p.y), q = 3;
    }
    index = index * 4 + q;
  }
  return index;
}

TEST(Sampling, triangles_are_even) {
  Worst off("chi-square of the triangle: normal deviate", kChiDeviate);
  const std::uint32_t n = scaled(200000u);
  std::vector<double> counts(256, 0);
  for (std::uint32_t i = 0; i < n; ++i)
    ++counts[quarter_of(glm::dvec2(sample_triangle(independent_point(kSeed + 3, i))), 4)];
  off.see(chi_deviate(counts, std::vector<double>(256, n / 256.0)));
}

// Visible normals: density G1 (o.h) D / o.z. In (u, turn) with tan^2 = alpha^2 u / (1 - u), D cos dw is du dturn.
TEST(Sampling, visible_normals_have_their_density_from_mirror_to_chalk_and_at_grazing_angles) {
  Worst off("chi-square of visible normals: normal deviate", kChiDeviate);
  constexpr std::size_t kSide = 16, kFine = 32;
  const std::uint32_t n = scaled(100000u);
  for (const double alpha : {1e-3, 0.05, 0.3, 1.0})
    for (const double cosine : {1.0, 0.5, 0.1, 0.01}) {
      const double sine = std::sqrt(1 - cosine * cosine);
      const double g1 = 1 / (0.5 + 0.5 * std::sqrt(1 + alpha * alpha * sine * sine / (cosine * cosine)));
      std::vector<double> expected(kSide * kSide, 0), counts(kSide * kSide, 0);
      for (std::size_t a = 0; a < kSide * kFine; ++a)
        for (std::size_t b = 0; b < kSide * kFine; ++b) {
          // Steps of equal width in w = sqrt(1 - u) within a cell: the tangent is infinite at u = 1.
          const double w0 = std::sqrt(1 - static_cast<double>(a / kFine + 1) / kSide);
          const double w1 = std::sqrt(1 - static_cast<double>(a / kFine) / kSide);
          const double w = w0 + (w1 - w0) * (static_cast<double>(a % kFine) + 0.5) / kFine;
          const double phi = ((static_cast<double>(b) + 0.5) / (kSide * kFine) - 0.5) * 2 * M_PI;
          const double tangent = alpha * std::sqrt(1 - w * w) / w;
          const double over_cos = sine * tangent * std::cos(phi) + cosine;  // (o.h) / cos h
          expected[a / kFine * kSide + b / kFine] +=
              std::max(0.0, over_cos) * g1 / cosine * n * 2 * w * (w1 - w0) / kFine / (kSide * kFine);
        }
      const glm::vec3 eye(static_cast<float>(sine), 0, static_cast<float>(cosine));
      for (std::uint32_t i = 0; i < n; ++i) {
        const glm::dvec3 h(sample_visible_normal(eye, static_cast<float>(alpha), independent_point(kSeed + 4, i)));
        const double slope2 = (h.x * h.x + h.y * h.y) / (h.z * h.z);
        ++counts[cell(slope2 / (alpha * alpha + slope2), kSide) * kSide + cell(turn_of(h.x, h.y), kSide)];
      }
      off.see(chi_deviate(counts, expected), "alpha", alpha, "cosine", cosine);
    }
}

TEST(Sampling, alias_tables_draw_by_weight_over_twenty_four_decades) {
  Worst off("chi-square of alias tables: normal deviate", kChiDeviate);
  const std::uint32_t n = scaled(200000u);
  for (const std::size_t size : {1u, 2u, 7u, 1000u})
    for (const double decades : {0.0, 1.0, 24.0}) {
      std::vector<double> weights(size), counts(size, 0), expected(size);
      double sum = 0;
      for (std::size_t i = 0; i < size; ++i)
        sum += weights[i] =
            std::pow(10.0, decades * (static_cast<double>(i * 7 % size) / static_cast<double>(size) - 0.5));
      for (std::size_t i = 0; i < size; ++i) expected[i] = n * weights[i] / sum;
      const AliasTable table(weights);
      for (std::uint32_t i = 0; i < n; ++i) {
        float xi = independent_point(kSeed + 5, i).x;
        ++counts[table.draw(xi)];
      }
      off.see(chi_deviate(counts, expected), "size", size, "decades", decades);
    }
}

// Lamps of unequal size, brightness and sides: triangles by power, points evenly, densities as told; slivers and
// triangles without area among them.
TEST(Sampling, emitters_are_drawn_by_power_and_evenly) {
  HandScene hand;
  const auto lamp = [&](float light, bool both) {
    auto m = HandScene::matte(glm::vec3(0), glm::vec3(light));
    m.double_sided = both;
    return hand.material(m);
  };
  hand.quad({0, 0, 0}, {1, 0, 0}, {0, 2, 0}, lamp(1, false));
  hand.quad({5, 0, 0}, {0.1f, 0, 0}, {0, 0.3f, 0}, lamp(40, true));
  hand.quad({9, 0, 0}, {3, 0, 0}, {0, 1e-4f, 0}, lamp(900, false));
  hand.quad({9, 1, 0}, {3, 0, 0}, {0, 0, 0}, lamp(1e6f, false));
  const auto rays = hand.rays();
  const LightSet lights(*rays);
  const double power[] = {2, 40 * 0.03 * 2, 900 * 3e-4, 0};
  const double all = power[0] + power[1] + power[2];
  constexpr std::size_t kCells = 64;
  std::vector<double> counts(4 * 2 * kCells, 0), expected(4 * 2 * kCells);
  const std::uint32_t n = scaled(200000u);
  for (std::size_t i = 0; i < expected.size(); ++i) expected[i] = n * power[i / (2 * kCells)] / all / (2 * kCells);
  Worst density("emitters: density told by the draw against power / area", 1e-5);
  for (std::uint32_t i = 0; i < n; ++i) {
    const auto draw = lights.draw_emitter(independent_point(kSeed + 6, i).x, independent_point(kSeed + 7, i));
    const auto which = static_cast<std::size_t>(draw.position.x < 2 ? 0 : draw.position.x < 7 ? 1 : 2);
    const auto& mesh = hand.scene.meshes[which];
    const glm::dvec3 a(mesh.positions[0]), x(glm::dvec3(mesh.positions[1]) - a), y(glm::dvec3(mesh.positions[3]) - a);
    const double s = std::clamp(glm::dot(glm::dvec3(draw.position) - a, x) / glm::dot(x, x), 0.0, 1.0);
    const double t = std::clamp(glm::dot(glm::dvec3(draw.position) - a, y) / glm::dot(y, y), 0.0, 1.0);
    // Quad a, a+x, a+x+y, a+y is split along its diagonal into (0, 1, 2) and (0, 2, 3).
    const std::size_t half = t > s ? 1 : 0;
    const glm::dvec2 b = half ? glm::dvec2(s, t - s) : glm::dvec2(s - t, t);
    ++counts[(which * 2 + half) * kCells + quarter_of(b, 3)];
    const double area = glm::length(x) * glm::length(y);
    const double truth = power[which] / all / area;
    density.see(std::abs(static_cast<double>(draw.pdf_area) / truth - 1));
    density.see(std::abs(
        static_cast<double>(lights.emitter_pdf(static_cast<std::uint32_t>(which), static_cast<std::uint32_t>(half))) /
            truth -
        1));
  }
  Worst off("chi-square of emitters: normal deviate", kChiDeviate);
  off.see(chi_deviate(counts, expected));
}

// Systematic picks among up to 256 lamps, one by intensity among more: the sum is unbiased for any number of picks.
TEST(Sampling, picks_of_lamps_add_up_to_all_of_them) {
  Worst off("lamps: mean of the picks against the sum in double, standard errors", kSigmas);
  for (const int lamps : {1, 5, 256, 300})
    for (const std::size_t picks : {1u, 2u, 4u}) {
      HandScene hand;
      hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(1))));
      double truth = 0;
      for (int i = 0; i < lamps; ++i) {
        scene::Light l;
        const auto x = static_cast<float>(i);
        l.position = {std::sin(x) * 4, 0.2f + 0.03f * x, std::cos(x * 1.3f) * 3};
        l.intensity = glm::vec3(i % 9 == 4 ? 30.0f : 1.0f);
        hand.scene.lights.push_back(l);
        const glm::dvec3 at(l.position);
        truth += double{l.intensity.x} / glm::dot(at, at);
      }
      const auto rays = hand.rays();
      const LightSet lights(*rays);
      const auto e = estimate(scaled(65536u), kSeed + 8, [&](Sampler& s) {
        std::array<PunctualDraw, 4> draws;
        const auto made =
            lights.draw_punctual(glm::vec3(0), {0, 1, 0}, false, s.next_1d(), std::span(draws).first(picks));
        float sum = 0;
        for (std::size_t i = 0; i < made; ++i) sum += draws[i].irradiance.x;
        return sum;
      });
      off.see(e.sigmas_from(truth, 1e-5 * truth), "lamps", lamps, "picks", picks, "mean", e.mean, "truth", truth);
    }
}

TEST(Sampling, bright_texels_are_drawn_as_densely_as_they_say) {
  Worst off("chi-square of points of bright texels: normal deviate", kChiDeviate);
  const LitRoom room(spot_light);
  const BrightTexels& bright = room.aimed->bright();
  ASSERT_FALSE(bright.empty());
  const auto& level = room.layout->levels.back();
  const int coarse = room.layout->coarse_level();
  const auto texel_of = [&](const SurfacePoint& p) {
    return room.layout->texel_at(room.layout->patch_of(p.instance, p.triangle, p.front), coarse,
                                 room.layout->patch_uv(p.instance, p.triangle, p.u, p.v));
  };
  const auto n = scaled(200000u);
  for (const glm::vec3 at : {glm::vec3(-0.6f, -2, -0.4f), glm::vec3(1.9f, 1.2f, -1.9f)}) {
    const auto aim = bright.aim(at, glm::normalize(-at), 0.5f);
    ASSERT_GT(aim.chance, 0);
    std::map<std::uint32_t, double> counts;
    std::vector<double> within(64, 0);
    double drawn = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      Sampler sampler(kSeed + 31, i, 0);
      const float pick = sampler.next_1d();
      const auto point = bright.draw(aim, pick, sampler.next_2d());
      if (!point) continue;
      const glm::vec2 texel = texel_of(*point);
      ++counts[static_cast<std::uint32_t>(texel.y) * level.width + static_cast<std::uint32_t>(texel.x)];
      const glm::dvec2 part(glm::fract(texel));
      ++within[cell(part.x, 8) * 8 + cell(part.y, 8)];
      ++drawn;
    }
    EXPECT_EQ(drawn, n) << "the spot's texels are all full";
    std::vector<double> seen, expected;
    double all = 0;
    for (std::size_t i = 0; i < bright.size(); ++i) {
      const auto [tile, texel, flux, soft, share] = bright.place(i);
      const auto point = room.mapper->tile(TileId(coarse, tile))->center(texel % kTileSize, texel / kTileSize);
      const auto s = trace::make_surface(*room.rays, *point);
      const glm::vec2 place = texel_of(*point);
      expected.push_back(n * double{bright.pdf_area(aim, *point, s.area)} / (double{level.density} * level.density));
      all += expected.back() / n;
      seen.push_back(counts[static_cast<std::uint32_t>(place.y) * level.width + static_cast<std::uint32_t>(place.x)]);
    }
    EXPECT_NEAR(all, 1, 1e-4);
    off.see(chi_deviate(seen, expected), "by texel");
    off.see(chi_deviate(within, std::vector<double>(64, n / 64.0)), "within them");
  }
}

}  // namespace
}  // namespace darm::numerical
