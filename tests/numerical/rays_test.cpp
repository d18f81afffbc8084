// Rays that start on, graze or aim exactly at surfaces, and lamps where formulas divide by nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <string>

#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/sampling.hpp"
#include "actors/renderer/trace/surface.hpp"
#include "tests/numerical/closed_forms.hpp"
#include "tests/numerical/statistics.hpp"
#include "tests/numerical/worst.hpp"
#include "tests/unit/scene/small_glb.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::numerical {
namespace {

using renderer::LightTransport;
using renderer::Sampler;
using renderer::TransportOptions;
using renderer::trace::Hit;
using renderer::trace::make_surface;
using renderer::trace::RayScene;
using renderer::trace::spawn_origin;
using test::HandScene;

LightTransport transport_of(const HandScene& hand, TransportOptions options = {}) {
  const auto scene = hand.share();
  return {scene, RayScene::build(scene, 1).value(), options};
}

glm::vec3 direction_of(const glm::vec2& xi) {
  const float z = 1 - 2 * xi.x, r = std::sqrt(std::max(0.0f, 1 - z * z));
  return {r * std::cos(2 * renderer::kPi * xi.y), r * std::sin(2 * renderer::kPi * xi.y), z};
}

struct Place {
  float size;
  glm::vec3 at;
};

/// From a tenth of a millimetre to ten kilometres, and far from the origin as far as float allows a shape of that size.
const Place kPlaces[] = {{1e-4f, {}},
                         {1e-2f, {}},
                         {1, {}},
                         {100, {}},
                         {1e4f, {}},
                         {1, {100, -70, 30}},
                         {100, {1e4f, 0, -3e4f}},
                         {1e3f, {1e6f, 0, 0}},
                         {1e4f, {1e6f, -1e6f, 1e6f}}};

// A ray that leaves a convex body outwards hits nothing; one that enters it hits the far side, whatever the scale.
TEST(Rays, leave_their_own_surface_and_do_not_leak_at_any_scale_or_place) {
  Worst own("self-intersection: rays that hit the surface they left", 0);
  Worst leak("leaks: rays from inside a closed body that escape", 0);
  for (const auto& place : kPlaces) {
    HandScene hand;
    hand.place(ball(place.size, 16, false, hand.material(HandScene::matte(glm::vec3(0.5f))), place.at));
    const auto rays = hand.rays();
    const auto triangles = static_cast<float>(hand.scene.meshes[0].triangles.size());
    for (std::uint32_t i = 0; i < scaled(40000u); ++i) {
      Sampler random(3, i, 0);
      SurfacePoint p{0, static_cast<std::uint32_t>(random.next_1d() * triangles), 0, 0, true};
      const glm::vec2 b = renderer::sample_triangle(random.next_2d());
      p.u = b.x, p.v = b.y;
      const auto s = make_surface(*rays, p);
      glm::vec3 d = direction_of(random.next_2d());
      const float cosine = glm::dot(d, s.geometric_normal);
      if (std::abs(cosine) < 1e-3f) continue;
      if (cosine < 0) d = -d;
      own.see(rays->occluded({spawn_origin(s, d), 0, d, 1e30f}) ? 1 : 0, "size", place.size, "x", place.at.x);
      leak.see(rays->occluded({spawn_origin(s, -d), 0, -d, 1e30f}) ? 0 : 1, "size", place.size, "x", place.at.x,
               "cosine", cosine);
    }
  }
}

// Radiance 1 in a closed room of any size, anywhere: a leak would darken it, a ray that meets its own wall as well.
TEST(Rays, a_closed_furnace_keeps_its_light_at_any_scale_and_place) {
  Worst off("closed furnace at any scale: radiance against 1, standard errors", kSigmas);
  for (const auto& place : kPlaces) {
    HandScene hand;
    const glm::vec3 half(0.5f * place.size);
    hand.box(place.at - half, place.at + half, hand.material(HandScene::matte(glm::vec3(0.5f), glm::vec3(0.5f))), true);
    const auto transport = transport_of(hand);
    const auto e = estimate(scaled(16384u), 4, [&](Sampler& s) {
      const glm::vec2 b = renderer::sample_triangle(s.next_2d());
      return transport.view_independent({1, 0, b.x, b.y, true}, s).sum().x;
    });
    off.see(e.sigmas_from(1, 2e-4), "size", place.size, "x", place.at.x, "mean", e.mean);
  }
}

// Exactly at a vertex or along an edge even the robust traversal may miss: rarely, and never once jittered by a hair.
TEST(Rays, aimed_at_vertices_and_edges_of_a_closed_body_hit_it) {
  Worst edges("rays exactly at edges: share that misses", 1e-3);
  Worst vertices("rays exactly at vertices: share that misses", 0.05);
  Worst jittered("rays a millionth beside: share that misses", 0);
  for (const auto& place : kPlaces) {
    HandScene hand;
    hand.place(ball(place.size, 16, true, hand.material(HandScene::matte(glm::vec3(0.5f))), place.at));
    const auto rays = hand.rays();
    const auto& mesh = hand.scene.meshes[0];
    int missed[3] = {0, 0, 0}, aimed[3] = {0, 0, 0};
    for (std::uint32_t i = 0; i < scaled(4000u); ++i) {
      Sampler random(6, i, 0);
      const glm::vec3 from = place.at + direction_of(random.next_2d()) * (0.7f * random.next_1d() * place.size);
      const auto& t = mesh.triangles[i % mesh.triangles.size()];
      const glm::vec3 a = mesh.positions[t.x], b = mesh.positions[t.y];
      const glm::vec3 beside = a + direction_of(random.next_2d()) * (1e-6f * place.size);
      int kind = 0;
      for (const glm::vec3 target : {a + (b - a) * random.next_1d(), a, beside}) {
        Hit hit;
        ++aimed[kind];
        missed[kind++] += rays->closest({from, 0, target - from, 1e30f}, hit) ? 0 : 1;
      }
    }
    edges.see(double(missed[0]) / aimed[0], "size", place.size, "x", place.at.x);
    vertices.see(double(missed[1]) / aimed[1], "size", place.size, "x", place.at.x);
    // Far out a millionth of the size is less than a step of float: it is the same point.
    if (glm::length(place.at) < 10 * place.size) jittered.see(double(missed[2]) / aimed[2], "size", place.size);
  }
}

// Zeros in a direction, of either sign, and rays within a wall's plane: where the ray meets a box is known exactly.
TEST(Rays, with_zero_components_meet_a_box_where_they_should) {
  Worst off("zero components: distance to the wall, relative", 1e-6);
  HandScene hand;
  hand.box(glm::vec3(-1), glm::vec3(1), hand.material(HandScene::matte(glm::vec3(0.5f))), true);
  const auto rays = hand.rays();
  const float zeros[] = {0.0f, -0.0f};
  for (int code = 1; code < 27; ++code)
    for (const float zero : zeros)
      for (const glm::vec3 from : {glm::vec3(0), glm::vec3(0.25f, -0.5f, 0.125f), glm::vec3(0.9999f)}) {
        glm::vec3 d;
        double wall = std::numeric_limits<double>::infinity();
        for (int axis = 0, rest = code; axis < 3; ++axis, rest /= 3) {
          const int step = rest % 3 - 1;
          d[axis] = step == 0 ? zero : static_cast<float>(step);
          if (step != 0) wall = std::min(wall, 1 - double{from[axis]} * step);
        }
        if (std::isinf(wall)) continue;
        Hit hit;
        const bool met = rays->closest({from, 0, d, 1e30f}, hit);
        off.see(met ? std::abs(double{hit.t} / wall - 1) : 1, "direction", d.x, d.y, d.z, "from", from.x);
        const auto s = make_surface(*rays, hit);
        EXPECT_TRUE(std::isfinite(s.position.x + s.position.y + s.position.z));
      }
  for (const float zero : zeros) {  // along the floor, within its plane: whatever it meets is a wall or nothing
    Hit hit;
    if (rays->closest({{0, -1, 0}, 0, {1, zero, zero}, 1e30f}, hit)) {
      EXPECT_TRUE(std::isfinite(hit.t) && hit.t >= 0 && hit.t <= 1.0001f) << hit.t;
    }
  }
}

Estimate light_at(const HandScene& hand, const SurfacePoint& at, std::uint32_t samples,
                  TransportOptions::Emitters strategy = TransportOptions::Emitters::kBoth) {
  TransportOptions options;
  options.emitters = strategy;
  const auto transport = transport_of(hand, options);
  return estimate(scaled(samples), 8, [&](Sampler& s) { return transport.irradiance(at, s).sum().x; });
}

// The inverse square law from the scene's own size down: a model in millimetres is lit like one in metres.
TEST(Lamps, follow_the_inverse_square_at_any_scale) {
  Worst off("point lamp: irradiance against the inverse square, relative", 1e-4);
  for (const float scale : {1e-4f, 1e-2f, 1.0f, 1e2f, 1e4f})
    for (const float height : {0.01f, 0.3f, 5.0f}) {
      HandScene hand;
      hand.quad({-scale, 0, scale}, {2 * scale, 0, 0}, {0, 0, -2 * scale},
                hand.material(HandScene::matte(glm::vec3(0.5f))));
      scene::Light lamp;
      lamp.position = {0, height * scale, 0};
      lamp.intensity = glm::vec3(1);
      hand.scene.lights.push_back(lamp);
      const double truth = 1 / std::pow(double{height} * scale, 2);
      const auto e = light_at(hand, {0, 0, 0.0f, 0.5f, true}, 64);
      off.see(std::abs(e.mean / truth - 1), "scale", scale, "height", height, "got", e.mean, "truth", truth);
    }
}

// Surface and lamp come from nodes a million metres out: their distance is taken in double before anything is float.
TEST(Lamps, of_a_scene_a_million_away_light_as_at_home) {
  Worst off("lamp at 1e6: irradiance against the inverse square, relative", 1e-5);
  for (const char* at : {"0,0,0", "1000000,0,0", "-1000000.25,1000000,999999.875"}) {
    scene::test::SmallScene small;
    const std::string parent = std::string(R"([{"children":[1,2],"translation":[)") + at + "]},";
    small.nodes =
        parent + R"({"mesh":0},{"translation":[0.3,0.2,0.5],"extensions":{"KHR_lights_punctual":{"light":0}}}])";
    small.more_members = R"(,"extensionsUsed":["KHR_lights_punctual"],"extensions":{"KHR_lights_punctual":{"lights":[)"
                         R"({"type":"point","intensity":5}]}})";
    const auto scene = scene::test::load(small).value();
    const LightTransport transport(scene, RayScene::build(scene, 1).value());
    Sampler random(1, 2, 3);
    const double got = static_cast<double>(transport.irradiance({0, 0, 0.3f, 0.2f, true}, random).sharp.x);
    off.see(std::abs(got / (5 / 0.25) - 1), at, "got", got);
  }
}

// On the surface, behind it, or without area, a lamp adds nothing; what lies beside is lit as if it were not there.
TEST(Lamps, at_no_distance_behind_or_without_area_add_nothing) {
  Worst dark("lamps that cannot light: irradiance they add", 0);
  Worst off("a lamp among them: irradiance against its closed form, standard errors", kSigmas);
  HandScene hand;
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(0.9f))));
  const auto add = [&](const glm::vec3& at) {
    scene::Light lamp;
    lamp.position = at;
    hand.scene.lights.push_back(lamp);
  };
  for (const float y : {0.0f, -1e-30f, -1e-7f, -1.0f, -1e4f}) add({0, y, 0});
  const auto bright = hand.material(HandScene::matte(glm::vec3(0), glm::vec3(7)));
  hand.quad({-1, -0.5f, -1}, {2, 0, 0}, {0, 0, 2}, bright);  // below, looking down at nothing
  hand.quad({-1, -0.5f, 1}, {2, 0, 0}, {0, 0, -2}, bright);  // below, looking up at the floor's back
  hand.quad({0, 1, 0}, {0, 0, 0}, {0, 0, 1}, bright);        // a line
  hand.quad({0, 1, 0}, {0, 0, 0}, {0, 0, 0}, bright);        // a point
  const SurfacePoint middle{0, 0, 0.0f, 0.5f, true};
  dark.see(light_at(hand, middle, 8192).mean);
  const auto disc = regular_polygon(0.7, 64, {0.2, 1, 0});
  auto mesh = fan(disc);
  mesh.material = bright;
  hand.place(mesh);
  const double truth = 7 * polygon_irradiance(disc, glm::dvec3(0), {0, 1, 0});
  const auto e = light_at(hand, middle, 65536);
  off.see(e.sigmas_from(truth, 1e-4 * truth), e.mean, truth);
}

// A lamp that stands on the surface: right beside the edge where they touch.
TEST(Lamps, touching_the_surface_light_it_as_lamberts_formula_says) {
  Worst off("touching lamp: irradiance against Lambert's formula, standard errors", kSigmas);
  for (const float aside : {1e-4f, 1e-2f, 0.3f})
    for (const auto strategy : {TransportOptions::Emitters::kBoth, TransportOptions::Emitters::kByDirection}) {
      HandScene hand;
      const auto floor =
          hand.quad({aside - 1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(0))));
      hand.quad({0, 0, -1}, {0, 1, 0}, {0, 0, 2}, hand.material(HandScene::matte(glm::vec3(0), glm::vec3(1))));
      const std::vector<glm::dvec3> wall = {{0, 0, -1}, {0, 1, -1}, {0, 1, 1}, {0, 0, 1}};
      const double truth = polygon_irradiance(wall, {double{aside}, 0, 0}, {0, 1, 0});
      const auto e = light_at(hand, {floor, 0, 0.0f, 0.5f, true}, 65536, strategy);
      off.see(e.sigmas_from(truth, 3e-4 * truth), "aside", aside, "strategy", static_cast<int>(strategy), e.mean,
              truth);
    }
}

// Lamps a thousand to a million times as long as they are wide.
TEST(Lamps, that_are_slivers_shine_by_their_area) {
  Worst off("slivers: irradiance against Lambert's formula, standard errors", kSigmas);
  for (const double ratio : {1e3, 1e5, 1e6})
    for (const auto strategy : {TransportOptions::Emitters::kBoth, TransportOptions::Emitters::kByLight}) {
      HandScene hand;
      const auto floor = hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(0))));
      // Looks down: counter-clockwise from below.
      const std::vector<glm::dvec3> sliver = {{-1, 1, 0.125}, {1, 1, 0.125}, {0.25, 1, 0.125 + 2 / ratio}};
      auto mesh = fan(sliver);
      mesh.material = hand.material(HandScene::matte(glm::vec3(0), glm::vec3(static_cast<float>(ratio))));
      hand.place(mesh);
      std::vector<glm::dvec3> as_float;
      for (const auto& p : mesh.positions) as_float.emplace_back(p);
      const double truth = ratio * polygon_irradiance(as_float, glm::dvec3(0), {0, 1, 0});
      const auto e = light_at(hand, {floor, 0, 0.0f, 0.5f, true}, 16384, strategy);
      off.see(e.sigmas_from(truth, 1e-3 * truth), "ratio", ratio, "strategy", static_cast<int>(strategy), e.mean,
              truth);
    }
}

// Smooth normals on a coarse ball: lit by the shading normal wherever the facet itself faces the sun, black where it
// does not. So no place is brighter than the smooth ball's, and the step at the terminator is at most the sine of the
// angle between the two normals.
TEST(Terminator, light_on_coarse_meshes_follows_the_shading_normal_up_to_the_facets_own_horizon) {
  Worst off("terminator: irradiance against the formula", 1e-5);
  Worst step("terminator: light missing against a smooth ball, over the sine of the normals' angle", 1.001);
  Worst lost("smooth normals: share of a bounce's light lost below the facet, over (1 - cos) / 2 of the angle", 1.05);
  for (const int segments : {4, 8, 16, 32}) {
    HandScene hand;
    hand.place(ball(1, segments, false, hand.material(HandScene::matte(glm::vec3(0.5f)))));
    const glm::vec3 towards = glm::normalize(glm::vec3(0.3f, 0.8f, -0.4f));
    scene::Light sun;
    sun.kind = scene::LightKind::kDirectional;
    sun.direction = -towards;
    hand.scene.lights.push_back(sun);
    const auto transport = transport_of(hand);
    const auto triangles = static_cast<float>(hand.scene.meshes[0].triangles.size());
    for (std::uint32_t i = 0; i < scaled(4000u); ++i) {
      Sampler random(12, i, 0);
      const auto triangle = static_cast<std::uint32_t>(random.next_1d() * triangles);
      const glm::vec2 b = renderer::sample_triangle(random.next_2d());
      const SurfacePoint p{0, triangle, b.x, b.y, true};
      const auto s = make_surface(transport.rays(), p);
      const double smooth = std::max(0.0, glm::dot(glm::dvec3(s.normal), glm::dvec3(towards)));
      const double facing = glm::dot(glm::dvec3(s.geometric_normal), glm::dvec3(towards));
      if (std::abs(facing) < 1e-4) continue;  // float decides
      const double got = static_cast<double>(transport.irradiance(p, random).sharp.x);
      off.see(std::abs(got - (facing > 0 ? smooth : 0)), "segments", segments);
      const double sine = glm::length(glm::cross(glm::dvec3(s.normal), glm::dvec3(s.geometric_normal)));
      if (sine > 1e-3) step.see((smooth - got) / sine, "segments", segments);
    }
    // Under an even sky the light that the shading normal expects from below the facet is missing.
    hand.scene.lights.clear();
    hand.scene.sky = {glm::vec3(1), glm::vec3(1), glm::vec3(1)};
    const auto under_sky = transport_of(hand);
    const SurfacePoint corner{0, 2 * static_cast<std::uint32_t>(segments), 0.02f, 0.02f, true};
    const auto s = make_surface(under_sky.rays(), corner);
    const double cosine = glm::dot(glm::dvec3(s.normal), glm::dvec3(s.geometric_normal));
    const auto e = estimate(scaled(65536u), 2, [&](Sampler& random) {
      return under_sky.irradiance(corner, random).soft.x / renderer::kPi;
    });
    if (cosine < 0.99999) lost.see((1 - e.mean - kSigmas * e.error) / (0.5 * (1 - cosine)), "segments", segments);
  }
}

}  // namespace
}  // namespace darm::numerical
