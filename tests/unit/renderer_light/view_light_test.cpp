// View-dependent light: what leaves a point for one eye beyond what leaves it for all.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>

#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/sampling.hpp"
#include "tests/unit/renderer_light/estimate.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::renderer {
namespace {

using test::HandScene;

const SurfacePoint kFloor{0, 0, 0.5f, 0.25f, true};

scene::Material metal(glm::vec3 base, float roughness) {
  scene::Material m;
  m.base_color = glm::vec4(base, 1.0f);
  m.metallic = 1;
  m.roughness = roughness;
  return m;
}

scene::Material plastic(glm::vec3 base, float roughness) {
  scene::Material m = metal(base, roughness);
  m.metallic = 0;
  return m;
}

// A floor of `material` (instance 0) in a closed box that glows and reflects.
HandScene room_with(const scene::Material& material) {
  HandScene hand;
  hand.quad({-0.5f, -0.8f, 0.5f}, {1, 0, 0}, {0, 0, -1}, hand.material(material));
  hand.box(glm::vec3(-1), glm::vec3(1), hand.material(HandScene::matte(glm::vec3(0.4f), glm::vec3(0.2f, 0.3f, 0.5f))),
           true);
  hand.quad({-0.9f, 0.9f, 0.2f}, {0, 0, 0.5f}, {0.5f, 0, 0},
            hand.material(HandScene::matte(glm::vec3(0.2f), glm::vec3(6.0f))));
  return hand;
}

TEST(ViewLight, a_mirror_shows_what_lies_in_the_mirrored_direction) {
  HandScene hand;
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(metal(glm::vec3(0.9f, 0.5f, 0.25f), 0)));
  // Left of x = -0.5 at height 1 it glows red, right of it green.
  hand.quad({-8, 1, -4}, {7.5f, 0, 0}, {0, 0, 8}, hand.material(HandScene::matte(glm::vec3(0), {2, 0, 0})));
  hand.quad({-0.5f, 1, -4}, {8, 0, 0}, {0, 0, 8}, hand.material(HandScene::matte(glm::vec3(0), {0, 3, 0})));
  for (auto& m : hand.scene.materials) m.double_sided = true;
  const auto transport = transport_of(hand);
  const auto at = trace::make_surface(transport.rays(), kFloor).position;
  const auto seen = [&](glm::vec3 eye, int channel) {
    return estimate(256, [&](Sampler& s) { return transport.view_dependent(kFloor, eye, s).radiance[channel]; }).mean;
  };
  const glm::vec3 right = at + glm::vec3(0.9f, 0.5f, 0);  // mirrored: towards -x, 1.8 m away at height 1
  EXPECT_NEAR(seen(right, 0), 2 * 0.9, 0.05);
  EXPECT_NEAR(seen(right, 1), 0, 1e-3);  // lamps are sampled into the tail of the lobe
  const glm::vec3 left = at + glm::vec3(-0.9f, 0.5f, 0);
  EXPECT_NEAR(seen(left, 0), 0, 1e-3);
  EXPECT_NEAR(seen(left, 1), 3 * 0.5, 0.1);
}

TEST(ViewLight, a_metal_in_a_furnace_neither_gains_nor_loses_but_for_multiple_scattering) {
  for (const float roughness : {0.0f, 0.1f, 0.3f}) {
    HandScene hand;
    hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(metal(glm::vec3(1), roughness)));
    hand.scene.sky = {glm::vec3(1), glm::vec3(1), glm::vec3(1)};
    const auto transport = transport_of(hand);
    for (const glm::vec3 eye : {glm::vec3(0.2f, 2, 0.1f), glm::vec3(2, 1, 0), glm::vec3(3, 0.3f, 1)}) {
      const auto e = estimate(4096, [&](Sampler& s) { return transport.view_dependent(kFloor, eye, s).radiance.x; });
      EXPECT_LE(e.mean, 1.0 + 5 * e.error + 1e-4);
      EXPECT_GE(e.mean, 1.0 - 0.45 * roughness - 5 * e.error - 1e-3) << roughness;
    }
  }
}

TEST(ViewLight, with_it_the_light_for_all_eyes_is_all_light) {
  scene::Material glow = plastic({0.5f, 0.2f, 0.1f}, 0.4f);
  glow.emissive = {0.1f, 0.2f, 0.3f};
  scene::Material frosted = plastic({0.9f, 0.8f, 0.7f}, 0.4f);
  frosted.transmission = 0.8f;
  frosted.double_sided = true;
  scene::Material half = metal({0.9f, 0.6f, 0.2f}, 0.3f);
  half.metallic = 0.5f;
  const std::vector<scene::Material> materials{plastic({0.8f, 0.6f, 0.4f}, 0.9f),
                                               plastic({0.2f, 0.2f, 0.9f}, 0.1f),
                                               metal({0.9f, 0.7f, 0.3f}, 0.25f),
                                               half,
                                               glow,
                                               frosted};
  std::uint64_t seed = 1;
  for (const auto& material : materials) {
    const auto transport = transport_of(room_with(material));
    for (int i = 0; i < 4; ++i) {
      Sampler where(7, static_cast<std::uint32_t>(seed), 0);
      const glm::vec2 uv = where.next_2d() * 0.5f;
      const SurfacePoint point{0, 0, uv.x, uv.y, true};
      const glm::vec3 position = trace::make_surface(transport.rays(), point).position;
      const glm::vec3 eye =
          position + [](const glm::vec3& d) { return glm::vec3(d.x, d.z, d.y); }(sample_cosine(where.next_2d())) * 0.5f;
      const trace::Ray ray{eye, 0, glm::normalize(position - eye), 1e30f};
      const double own = transport.emission(point).y;
      const auto all = estimate(8192, [&](Sampler& s) { return transport.full_radiance(ray, s).y; }, seed++);
      const auto parts = estimate(
          8192,
          [&](Sampler& s) {
            const double shared = transport.view_independent(point, s).sum().y;
            const auto view = transport.view_dependent(point, eye, s);
            return own + view.diffuse_factor * (shared - own) + view.radiance.y;
          },
          seed++);
      EXPECT_NEAR(parts.mean, all.mean, 5 * std::hypot(parts.error, all.error) + 1e-3 * all.mean)
          << "roughness " << material.roughness << " metallic " << material.metallic;
    }
  }
}

TEST(ViewLight, clear_glass_leaves_the_passage_to_who_draws_and_reflects_the_rest) {
  scene::Material pane = plastic({0.5f, 0.8f, 1.0f}, 0);
  pane.transmission = 1;
  pane.double_sided = true;
  HandScene hand;
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(pane));
  hand.scene.sky = {glm::vec3(1), glm::vec3(1), glm::vec3(4)};
  const auto transport = transport_of(hand);
  const glm::vec3 at = trace::make_surface(transport.rays(), kFloor).position;
  EXPECT_NEAR(transport.clear_tint(kFloor).x, 0.5f, 1e-5f);
  for (const glm::vec3 away : {glm::vec3(0.1f, 1, 0), glm::vec3(1, 0.3f, 0)}) {
    const glm::vec3 eye = at + away;
    const double cosine = double(glm::normalize(away).y);
    const double fresnel = 0.04 + 0.96 * std::pow(1 - cosine, 5);
    const auto own = estimate(2048, [&](Sampler& s) { return transport.view_dependent(kFloor, eye, s).radiance.x; });
    EXPECT_NEAR(own.mean, fresnel, 5 * own.error + 0.01 * fresnel);
    const trace::Ray ray{eye, 0, glm::normalize(at - eye), 1e30f};
    const auto all = estimate(8192, [&](Sampler& s) { return transport.full_radiance(ray, s).x; });
    EXPECT_NEAR(own.mean + 4 * 0.5 * (1 - fresnel), all.mean, 5 * std::hypot(own.error, all.error) + 0.01);
  }
}

TEST(ViewLight, a_refracting_ball_is_opaque_and_shows_what_lies_behind_it) {
  scene::Material glass = plastic(glm::vec3(1), 0);
  glass.transmission = 1;
  glass.thickness = 1;
  HandScene hand;
  const auto material = hand.material(glass);
  hand.box(glm::vec3(-0.5f), glm::vec3(0.5f), material, false);
  hand.scene.sky = {glm::vec3(1), glm::vec3(1), glm::vec3(1)};
  const auto transport = transport_of(hand);
  // A furnace: nothing is absorbed, so that the block cannot be seen.
  const SurfacePoint side{0, 0, 0.3f, 0.3f, true};
  const auto s = trace::make_surface(transport.rays(), side);
  const auto e = estimate(4096, [&](Sampler& p) {
    return transport.view_dependent(side, s.position + s.geometric_normal * 2.0f, p).radiance.x;
  });
  EXPECT_NEAR(e.mean, 1.0, 5 * e.error + 0.03);
  EXPECT_EQ(transport.clear_tint(side), glm::vec3(0.0f));
}

TEST(ViewLight, an_eye_at_or_behind_the_point_gives_finite_light) {
  const auto transport = transport_of(room_with(plastic(glm::vec3(0.5f), 0.2f)));
  const glm::vec3 at = trace::make_surface(transport.rays(), kFloor).position;
  Sampler sampler(1, 2, 3);
  EXPECT_EQ(transport.view_dependent(kFloor, at, sampler).radiance, glm::vec3(0.0f));
  for (const glm::vec3 eye : {at - glm::vec3(0, 0.1f, 0), at + glm::vec3(1, 0, 0), glm::vec3(NAN)})
    for (std::uint32_t i = 0; i < 64; ++i) {
      Sampler s(1, 2, i);
      const auto light = transport.view_dependent(kFloor, eye, s).radiance;
      EXPECT_TRUE(std::isfinite(light.x + light.y + light.z));
      EXPECT_GE(light.x, 0);
    }
}

// A closed body whose walls are thin and rough: the ray that its front scattered comes through the far wall's back.
TEST(FrostedBody, is_as_bright_single_sided_as_double_sided) {
  std::array<double, 2> mean{};
  for (const bool double_sided : {false, true}) {
    test::HandScene hand;
    auto frosted = test::HandScene::matte(glm::vec3(1));
    frosted.transmission = 1;
    frosted.roughness = 0.4f;
    frosted.ior = 1.5f;
    frosted.double_sided = double_sided;
    hand.box(glm::vec3(-1), glm::vec3(1), hand.material(frosted), false);
    hand.scene.sky = {glm::vec3(1), glm::vec3(1), glm::vec3(1)};
    const auto scene = hand.share();
    const LightTransport transport(scene, trace::RayScene::build(scene, 1).value());
    trace::Ray ray;
    ray.origin = {0.1f, 0.2f, 5};
    constexpr int kPaths = 4096;
    for (std::uint32_t i = 0; i < kPaths; ++i) {
      Sampler sampler(3, 5, i);
      mean[double_sided ? 1 : 0] += static_cast<double>(transport.full_radiance(ray, sampler).y) / kPaths;
    }
  }
  // Energy is lost to lobes of one scattering alone; the bound is five standard errors (a path is at most 1 here).
  EXPECT_GT(mean[0], 0.5);
  EXPECT_NEAR(mean[0], mean[1], 5 * 0.5 / 64);
}

}  // namespace
}  // namespace darm::renderer
