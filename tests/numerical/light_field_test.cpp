// Whole light paths against closed forms: furnaces, and the form factors of squares and a disc.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/sampling.hpp"
#include "tests/numerical/closed_forms.hpp"
#include "tests/numerical/statistics.hpp"
#include "tests/numerical/worst.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::numerical {
namespace {

using renderer::LightTransport;
using renderer::Sampler;
using renderer::TransportOptions;
using renderer::trace::Ray;
using test::HandScene;
using Emitters = TransportOptions::Emitters;

LightTransport transport_of(const HandScene& hand, TransportOptions options = {}) {
  const auto scene = hand.share();
  return {scene, renderer::trace::RayScene::build(scene, 1).value(), options};
}

glm::vec3 any_direction(Sampler& s) {
  const glm::vec2 xi = s.next_2d();
  const float z = 1 - 2 * xi.x, r = std::sqrt(std::max(0.0f, 1 - z * z));
  return {r * std::cos(2 * renderer::kPi * xi.y), r * std::sin(2 * renderer::kPi * xi.y), z};
}

// Radiance e / (1 - a) everywhere, by whatever estimator, in rooms with square and with round corners. (A lamp's
// strategy alone has no finite variance where lamps meet the surface.)
TEST(Field, closed_furnaces_reach_emission_over_one_minus_albedo) {
  Worst off("closed furnace: radiance against 1, standard errors", kSigmas);
  for (const float albedo : {0.0f, 0.5f, 0.9f})
    for (const bool round : {false, true})
      for (const auto strategy : {Emitters::kBoth, Emitters::kByDirection}) {
        HandScene hand;
        const auto m = hand.material(HandScene::matte(glm::vec3(albedo), glm::vec3(1 - albedo)));
        if (round)
          hand.place(flat(ball(1, 12, true, m)));  // smooth normals lose light at every bounce
        else
          hand.box(glm::vec3(-1), glm::vec3(1), m, true);
        TransportOptions options;
        options.emitters = strategy;
        options.max_bounces = 400;
        const auto transport = transport_of(hand, options);
        const std::uint32_t n = scaled(8192u);
        const auto see = [&](const char* which, const Estimate& e) {
          off.see(e.sigmas_from(1, 2e-4), which, "albedo", albedo, round ? "ball" : "box", "strategy",
                  static_cast<int>(strategy), "mean", e.mean);
        };
        const auto ray = [](Sampler& s) { return Ray{{0.1f, 0.2f, 0.3f}, 0, any_direction(s), 1e30f}; };
        see("texel", estimate(n, 1, [&](Sampler& s) {
              const glm::vec2 b = renderer::sample_triangle(s.next_2d());
              return transport.view_independent({0, 1, b.x, b.y, true}, s).sum().x;
            }));
        see("full", estimate(n, 2, [&](Sampler& s) { return transport.full_radiance(ray(s), s).y; }));
        see("view-independent",
            estimate(n, 3, [&](Sampler& s) { return transport.view_independent_radiance(ray(s), s).z; }));
      }
}

struct Body {
  const char* name;
  float roughness, metallic, transmission, thickness, ior;
  double truth;  // -1: at most 1
};

// A convex body of each material under a sky of 1: it cannot be brighter than the sky, and where every lobe is smooth
// (or there is no lobe but Lambert's) it cannot be seen at all.
TEST(Field, white_bodies_in_a_white_sky_gain_nothing_and_vanish_where_no_lobe_loses) {
  Worst gain("white sky: light gained by a body, standard errors", kSigmas);
  Worst off("white sky: radiance of invisible bodies against 1, standard errors", kSigmas);
  const Body bodies[] = {{"chalk", 1, 0, 0, 0, 1, 1},           {"mirror", 0, 1, 0, 0, 1.5f, 1},
                         {"plastic", 0.5f, 0, 0, 0, 1.5f, -1},  {"smooth plastic", 0, 0, 0, 0, 1.5f, 1},
                         {"brushed", 0.5f, 1, 0, 0, 1.5f, -1},  {"chalky metal", 1, 1, 0, 0, 1.5f, -1},
                         {"alloy", 0.3f, 0.5f, 0, 0, 1.5f, -1}, {"pane", 0, 0, 1, 0, 1.5f, 1},
                         {"frosted", 0.5f, 0, 1, 0, 1.5f, -1},  {"nothing", 0.3f, 0, 1, 1, 1, 1},
                         {"air", 0, 0, 1, 1, 1.0001f, 1},       {"water", 0, 0, 1, 1, 1.33f, 1},
                         {"glass", 0, 0, 1, 1, 1.5f, 1},        {"diamond", 0, 0, 1, 1, 2.4f, 1},
                         {"ice", 0.4f, 0, 1, 1, 1.31f, -1}};
  for (const auto& b : bodies) {
    HandScene hand;
    auto m = HandScene::matte(glm::vec3(1));
    m.roughness = b.roughness;
    m.metallic = b.metallic;
    m.transmission = b.transmission;
    m.thickness = b.thickness;
    m.ior = b.ior;
    m.double_sided = b.transmission > 0;
    hand.box(glm::vec3(-1), glm::vec3(1), hand.material(m), false);
    hand.scene.sky = {glm::vec3(1), glm::vec3(1), glm::vec3(1)};
    TransportOptions options;
    options.max_bounces = 200;
    const auto transport = transport_of(hand, options);
    const auto e = estimate(scaled(16384u), 7, [&](Sampler& s) {
      const glm::vec3 from = any_direction(s) * 5.0f;
      const glm::vec3 at = glm::vec3(s.next_2d(), s.next_1d()) * 1.8f - 0.9f;
      return transport.full_radiance({from, 0, glm::normalize(at - from), 1e30f}, s).x;
    });
    // Plastic smoother than a mirror's alpha still scatters a little below the horizon: 1e-3 of what is reflected.
    if (b.truth > 0) off.see(e.sigmas_from(b.truth, 1.5e-3), b.name, "mean", e.mean);
    gain.see(std::max(0.0, e.mean - 1 - 1e-3) / std::max(e.error, 1e-12), b.name, "mean", e.mean);
  }
}

/// Irradiance on a unit square in y = 0, averaged over it, from a white lamp of radiance 1.
Estimate mean_irradiance(const HandScene& lamp, Emitters strategy) {
  HandScene hand = lamp;
  const auto black = hand.material(HandScene::matte(glm::vec3(0)));
  const auto floor = hand.quad({0, 0, 1}, {1, 0, 0}, {0, 0, -1}, black);
  TransportOptions options;
  options.emitters = strategy;
  const auto transport = transport_of(hand, options);
  return estimate(scaled(131072u), 9, [&](Sampler& s) {
    const auto triangle = static_cast<std::uint32_t>(s.next_1d() < 0.5f ? 0 : 1);
    const glm::vec2 b = renderer::sample_triangle(s.next_2d());
    return transport.irradiance({floor, triangle, b.x, b.y, true}, s).soft.x;
  });
}

TEST(Field, irradiance_between_squares_is_pi_times_their_form_factor) {
  Worst off("squares: irradiance against the form factor, standard errors", kSigmas);
  const auto lamp = HandScene::matte(glm::vec3(0), glm::vec3(1));
  for (const auto strategy : {Emitters::kBoth, Emitters::kByLight, Emitters::kByDirection}) {
    for (const float distance : {0.1f, 1.0f, 10.0f}) {
      HandScene facing;
      facing.quad({0, distance, 0}, {1, 0, 0}, {0, 0, 1}, facing.material(lamp));
      const double truth = M_PI * facing_squares(static_cast<double>(distance));
      const auto e = mean_irradiance(facing, strategy);
      off.see(e.sigmas_from(truth, 1e-4 * truth), "facing at", distance, "strategy", static_cast<int>(strategy), e.mean,
              truth);
    }
    // With a common edge a lamp's own strategy has no finite variance: the distance goes to 0.
    if (strategy == Emitters::kByLight) continue;
    HandScene upright;
    upright.quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, upright.material(lamp));
    const auto e = mean_irradiance(upright, strategy);
    const double truth = M_PI * upright_squares();
    off.see(e.sigmas_from(truth, 1e-4 * truth), "upright, strategy", static_cast<int>(strategy), e.mean, truth);
  }
}

TEST(Field, irradiance_under_a_disc_follows_its_closed_form_on_and_off_the_axis) {
  Worst off("disc: irradiance against Howell's B-12, standard errors", kSigmas);
  Worst corner("disc: Lambert's polygon formula against Howell's B-12", 1e-3);
  for (const double height : {0.2, 1.0, 5.0})
    for (const double aside : {0.0, 0.5, 2.0}) {
      HandScene hand;
      const auto disc = regular_polygon(0.7, 256, {aside, height, 0});
      scene::Mesh mesh = fan(disc);
      mesh.material = hand.material(HandScene::matte(glm::vec3(0), glm::vec3(1)));
      hand.place(mesh);
      const auto floor = hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(0))));
      const double truth = M_PI * disc_above(0.7, height, aside);
      corner.see(std::abs(polygon_irradiance(disc, glm::dvec3(0), {0, 1, 0}) / truth - 1), height, aside);
      for (const auto strategy : {Emitters::kBoth, Emitters::kByLight, Emitters::kByDirection}) {
        TransportOptions options;
        options.emitters = strategy;
        const auto transport = transport_of(hand, options);
        const auto e = estimate(scaled(32768u), 13, [&](Sampler& s) {
          return transport.irradiance({floor, 0, 0.0f, 0.5f, true}, s).soft.x;  // the middle of the diagonal
        });
        off.see(e.sigmas_from(truth, 1e-3 * truth), "height", height, "aside", aside, "strategy",
                static_cast<int>(strategy), e.mean, truth);
      }
    }
}

}  // namespace
}  // namespace darm::numerical
