#include "actors/renderer/light_transport.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/unit/renderer_light/estimate.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::renderer {
namespace {

using test::HandScene;

const SurfacePoint kFloor{0, 0, 0.5f, 0.25f, true};

scene::Light sun(float degrees, glm::vec3 towards, float lux) {
  scene::Light l;
  l.kind = scene::LightKind::kDirectional;
  l.direction = -glm::normalize(towards);
  l.intensity = glm::vec3(lux);
  l.angular_diameter = degrees * kPi / 180;
  return l;
}

TEST(LightTransport, closed_furnace_reaches_emission_over_one_minus_albedo) {
  HandScene hand;
  hand.box(glm::vec3(-1), glm::vec3(1), hand.material(HandScene::matte(glm::vec3(0.5f), glm::vec3(0.5f))), true);
  const auto transport = transport_of(hand);
  expect_agrees(estimate(40000, [&](Sampler& s) { return transport.view_independent(kFloor, s).sum().x; }), 1.0);
  const trace::Ray ray{{0.1f, 0.2f, 0.3f}, 0, glm::normalize(glm::vec3(0.3f, -0.8f, 0.2f)), 1e30f};
  expect_agrees(estimate(40000, [&](Sampler& s) { return transport.full_radiance(ray, s).y; }), 1.0);
  expect_agrees(estimate(40000, [&](Sampler& s) { return transport.view_independent_radiance(ray, s).z; }), 1.0);
}

TEST(LightTransport, sun_irradiance_is_cosine_times_lux_for_a_point_and_for_a_disc) {
  for (const float degrees : {0.0f, 0.53f, 10.0f}) {
    HandScene hand;
    hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(0.8f))));
    const glm::vec3 towards = glm::normalize(glm::vec3(0.3f, 1, 0.2f));
    hand.scene.lights.push_back(sun(degrees, towards, 1000));
    const auto transport = transport_of(hand);
    expect_agrees(estimate(20000, [&](Sampler& s) { return transport.irradiance(kFloor, s).sharp.x; }),
                  1000.0 * towards.y);
    expect_agrees(estimate(20000, [&](Sampler& s) { return transport.view_independent(kFloor, s).sum().x; }),
                  1000.0 * towards.y * 0.8 / kPi);
    const trace::Ray ray{{0, 1, 0}, 0, {0, -1, 0}, 1e30f};  // through the whole tracer, sun taken by both strategies
    expect_agrees(estimate(40000, [&](Sampler& s) { return transport.full_radiance(ray, s).x; }),
                  1000.0 * towards.y * 0.8 / kPi);
  }
}

TEST(LightTransport, point_light_follows_the_inverse_square_and_many_lights_add_up) {
  HandScene hand;
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(1))));
  double truth = 0;
  const auto scene = hand.share();
  const auto rays = trace::RayScene::build(scene, 1).value();
  const glm::vec3 at = trace::make_surface(*rays, kFloor).position;
  for (int i = 0; i < 300; ++i) {  // more than LightSet looks at one by one
    scene::Light l;
    l.position = {std::sin(static_cast<float>(i)) * 2, 0.5f + 0.01f * static_cast<float>(i),
                  std::cos(static_cast<float>(i))};
    l.intensity = glm::vec3(1.0f + static_cast<float>(i % 7));
    hand.scene.lights.push_back(l);
    const glm::vec3 to = l.position - at;
    truth += double(l.intensity.x) * to.y / std::pow(double(glm::length(to)), 3);
    if (i == 0 || i == 99 || i == 299) {
      const auto transport = transport_of(hand);
      expect_agrees(estimate(30000, [&](Sampler& s) { return transport.irradiance(kFloor, s).sharp.x; }), truth);
    }
  }
}

TEST(LightTransport, a_spot_lights_its_cone_and_a_range_ends_its_reach) {
  HandScene hand;
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(1))));
  scene::Light l;
  l.kind = scene::LightKind::kSpot;
  l.position = {0.5f, 2, 0};
  l.direction = {0, -1, 0};
  l.intensity = glm::vec3(8);
  l.cos_inner = std::cos(0.3f);
  l.cos_outer = std::cos(0.5f);
  hand.scene.lights = {l};
  const auto at = [&](float u, float v) {
    const auto transport = transport_of(hand);
    return estimate(64, [&](Sampler& s) { return transport.irradiance({0, 0, u, v, true}, s).sharp.x; }).mean;
  };
  EXPECT_NEAR(at(0.25f, 0.5f), 2.0, 1e-3);  // the point straight below
  hand.scene.lights[0].position.x = -1.5f;
  EXPECT_EQ(at(0.25f, 0.5f), 0.0);
  hand.scene.lights[0].position.x = 0.5f;
  hand.scene.lights[0].range = 1.9f;
  EXPECT_EQ(at(0.25f, 0.5f), 0.0);
}

TEST(LightTransport, irradiance_between_facing_squares_is_their_form_factor) {
  HandScene hand;
  hand.quad({-0.5f, 0, 0.5f}, {1, 0, 0}, {0, 0, -1}, hand.material(HandScene::matte(glm::vec3(0))));
  auto lamp = HandScene::matte(glm::vec3(0), glm::vec3(3));
  hand.quad({-0.5f, 1, -0.5f}, {1, 0, 0}, {0, 0, 1}, hand.material(lamp));
  // Centre of the lower square: four corner configurations of half the side (Howell's catalogue B-4), at distance 1.
  const double a = 0.5;
  const double quarter = 1 / (2 * M_PI) * 2 * (a / std::sqrt(1 + a * a) * std::atan(a / std::sqrt(1 + a * a)));
  const double truth = 3 * M_PI * 4 * quarter;
  using Emitters = TransportOptions::Emitters;
  for (const auto strategy : {Emitters::kBoth, Emitters::kByLight, Emitters::kByDirection}) {
    TransportOptions options;
    options.emitters = strategy;
    const auto transport = transport_of(hand, options);
    const auto centre = SurfacePoint{0, 0, 0.0f, 0.5f, true};
    expect_agrees(estimate(60000, [&](Sampler& s) { return transport.irradiance(centre, s).soft.x; }), truth);
  }
}

TEST(LightTransport, either_strategy_alone_agrees_with_both_on_glossy_surfaces) {
  for (const float roughness : {0.15f, 0.4f, 1.0f}) {
    HandScene hand;
    scene::Material m;
    m.base_color = {0.9f, 0.6f, 0.3f, 1};
    m.metallic = 0.5f;
    m.roughness = roughness;
    hand.quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, hand.material(m));
    hand.quad({-0.5f, 1, -0.5f}, {1, 0, 0}, {0, 0, 1}, hand.material(HandScene::matte(glm::vec3(0.2f), glm::vec3(3))));
    const trace::Ray ray{{1, 0.9f, 0}, 0, glm::normalize(glm::vec3(-1, -0.9f, 0.1f)), 1e30f};
    Estimate made[3];
    for (int i = 0; i < 3; ++i) {
      TransportOptions options;
      options.emitters = static_cast<TransportOptions::Emitters>(i);
      const auto transport = transport_of(hand, options);
      made[i] = estimate(100000, [&](Sampler& s) { return transport.full_radiance(ray, s).x; });
    }
    EXPECT_NEAR(made[0].mean, made[1].mean, 5 * std::hypot(made[0].error, made[1].error));
    EXPECT_NEAR(made[0].mean, made[2].mean, 5 * std::hypot(made[0].error, made[2].error));
    EXPECT_LT(made[0].error, 1.2 * std::min(made[1].error, made[2].error));
  }
}

TEST(LightTransport, a_floor_under_uniform_sky_sees_pi_times_its_radiance) {
  HandScene hand;
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(0.6f))));
  hand.scene.sky = {glm::vec3(2), glm::vec3(2), glm::vec3(0)};
  const auto transport = transport_of(hand);
  expect_agrees(estimate(2000, [&](Sampler& s) { return transport.irradiance(kFloor, s).soft.x; }), 2 * M_PI);
  EXPECT_NEAR(transport.diffuse_albedo(kFloor).x, 0.6, 1e-5);
}

TEST(LightTransport, backs_of_single_sided_triangles_are_black_and_block) {
  HandScene hand;
  const auto matte = hand.material(HandScene::matte(glm::vec3(0.6f), glm::vec3(5)));
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, matte);
  hand.quad({-9, 1, -9}, {0, 0, 18}, {18, 0, 0}, matte);  // a ceiling whose front looks up, its back at the floor
  hand.scene.sky = {glm::vec3(2), glm::vec3(2), glm::vec3(2)};
  hand.scene.lights.push_back(sun(0.5f, {0, 1, 0}, 100));
  const auto transport = transport_of(hand);
  const SurfacePoint back{0, 0, 0.5f, 0.25f, false};
  Sampler sampler(1, 2, 3);
  EXPECT_EQ(transport.view_independent(back, sampler).sum().x, 0);
  EXPECT_EQ(transport.diffuse_albedo(back).x, 0);
  EXPECT_EQ(estimate(500, [&](Sampler& s) { return transport.irradiance(kFloor, s).sharp.x; }).mean, 0);
  EXPECT_LT(estimate(500, [&](Sampler& s) { return transport.irradiance(kFloor, s).soft.x; }).mean, 0.5);
  const trace::Ray down{{0, 3, 0}, 0, {0, -1, 0}, 1e30f};
  const trace::Ray up{{0, -3, 0}, 0, {0.05f, 1, 0}, 1e30f};  // a camera below looks through both backs into the sky
  EXPECT_GT(transport.view_independent_radiance(down, sampler).x, 5);
  EXPECT_NEAR(transport.view_independent_radiance(up, sampler).x, 2, 1e-5);
  EXPECT_NEAR(transport.full_radiance(up, sampler).x, 2, 1e-5);
}

TEST(LightTransport, blend_lets_its_share_through_for_cameras_suns_and_sky) {
  HandScene hand;
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(0.5f))));
  auto veil = HandScene::matte(glm::vec3(0.0f));
  veil.alpha_mode = scene::AlphaMode::kBlend;
  veil.base_color.w = 0.25f;
  veil.double_sided = true;
  hand.quad({-50, 1, 50}, {100, 0, 0}, {0, 0, -100}, hand.material(veil));
  hand.scene.lights.push_back(sun(0.0f, {0, 1, 0}, 100));
  hand.scene.sky = {glm::vec3(2), glm::vec3(2), glm::vec3(2)};
  const auto transport = transport_of(hand);
  expect_agrees(estimate(2000, [&](Sampler& s) { return transport.irradiance(kFloor, s).sharp.x; }), 75.0);
  expect_agrees(estimate(40000, [&](Sampler& s) { return transport.irradiance(kFloor, s).soft.x; }), 1.5 * M_PI, 3e-3);
  const double floor = 0.5 / M_PI * (75 + 1.5 * M_PI);
  const trace::Ray ray{{0, 3, 0}, 0, {0, -1, 0}, 1e30f};
  expect_agrees(estimate(40000, [&](Sampler& s) { return transport.view_independent_radiance(ray, s).x; }),
                0.75 * floor, 3e-3);
  expect_agrees(estimate(40000, [&](Sampler& s) { return transport.full_radiance(ray, s).x; }), 0.75 * floor, 3e-3);
}

TEST(LightTransport, clear_thin_walls_tint_what_is_behind) {
  HandScene hand;
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(0.0f), glm::vec3(10))));
  auto glass = HandScene::matte(glm::vec3(0.8f, 0.4f, 0.2f));
  glass.transmission = 1;
  glass.roughness = 0;
  glass.ior = 1.5f;
  glass.double_sided = true;
  hand.quad({-5, 1, 5}, {10, 0, 0}, {0, 0, -10}, hand.material(glass));
  const auto transport = transport_of(hand);
  const trace::Ray ray{{0, 3, 0}, 0, {0, -1, 0}, 1e30f};
  Sampler sampler(1, 2, 3);
  EXPECT_NEAR(transport.view_independent_radiance(ray, sampler).y, 4, 1e-4);
  expect_agrees(estimate(40000, [&](Sampler& s) { return transport.full_radiance(ray, s).y; }), 4 * 0.96);
}

TEST(LightTransport, a_refracting_slab_dims_by_beer_lambert_and_keeps_a_uniform_sky) {
  HandScene hand;
  auto glass = HandScene::matte(glm::vec3(1.0f));
  glass.transmission = 1;
  glass.roughness = 0;
  glass.ior = 1.5f;
  glass.thickness = 1;
  const auto index = hand.material(glass);
  hand.box({-20, -0.5f, -20}, {20, 0.5f, 20}, index, false);
  hand.scene.sky = {glm::vec3(1), glm::vec3(1), glm::vec3(1)};
  const trace::Ray ray{{0, 3, 0}, 0, glm::normalize(glm::vec3(0.5f, -1, 0)), 1e30f};
  {
    const auto transport = transport_of(hand);  // clear glass in a white room is invisible
    const auto e = estimate(40000, [&](Sampler& s) { return transport.full_radiance(ray, s).x; });
    EXPECT_NEAR(e.mean, 1.0, 0.01 + 5 * e.error);
  }
  hand.scene.materials[index].attenuation_color = glm::vec3(0.5f);
  hand.scene.materials[index].attenuation_distance = 1;
  const auto transport = transport_of(hand);
  const double sine = std::sin(std::atan(0.5)) / 1.5;
  const double once = std::pow(0.5, 1 / std::sqrt(1 - sine * sine));
  const double r = 0.04;  // nearly; total = r + (1-r)^2 t / (1 - r t) in a slab
  const auto e = estimate(40000, [&](Sampler& s) { return transport.full_radiance(ray, s).x; });
  EXPECT_NEAR(e.mean, r + (1 - r) * (1 - r) * once / (1 - r * once), 0.01 + 5 * e.error);
}

TEST(LightTransport, lights_on_the_surface_give_finite_light) {
  HandScene hand;
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(0.9f), glm::vec3(1))));
  auto lamp = HandScene::matte(glm::vec3(0.9f), glm::vec3(1));
  lamp.double_sided = true;
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(lamp));  // the same plane
  const auto rays = hand.rays();
  for (const float height : {0.0f, 1e-20f, 1e-7f, -1e-7f}) {
    scene::Light l;
    l.position = trace::make_surface(*rays, kFloor).position + glm::vec3(0, height, 0);
    hand.scene.lights.push_back(l);
  }
  hand.scene.lights.push_back(sun(180, {0, 1, 0}, 10));
  hand.scene.lights.push_back(sun(0.5f, {1, 0, 0}, 10));
  const auto transport = transport_of(hand);
  for (std::uint32_t i = 0; i < 2000; ++i) {
    Sampler sampler(5, 6, i);
    const auto light = transport.view_independent(kFloor, sampler).sum();
    ASSERT_TRUE(std::isfinite(light.x) && light.x >= 0);
    const trace::Ray ray{{0, 1, 0}, 0, {0, -1, 0}, 1e30f};
    ASSERT_TRUE(std::isfinite(transport.full_radiance(ray, sampler).x));
  }
}

TEST(LightTransport, unlit_surfaces_show_their_base_colour) {
  HandScene hand;
  auto m = HandScene::matte(glm::vec3(0.3f, 0.5f, 0.7f));
  m.unlit = true;
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(m));
  hand.scene.lights.push_back(sun(0.5f, {0, 1, 0}, 1000));
  const auto transport = transport_of(hand);
  Sampler sampler(1, 1, 1);
  EXPECT_NEAR(transport.view_independent(kFloor, sampler).sum().y, 0.5, 1e-6);
  EXPECT_NEAR(transport.full_radiance({{0, 1, 0}, 0, {0, -1, 0}, 1e30f}, sampler).z, 0.7, 1e-6);
}

}  // namespace
}  // namespace darm::renderer
