// The integrator that a scene's plan picks gives the light of the one with everything on, bit by bit, and runs no code
// of an effect that the scene lacks.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <functional>

#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/plan_cost.hpp"
#include "actors/renderer/trace/effect_tally.hpp"
#include "actors/scene/gltf_loader.hpp"
#include "actors/scene/without_effect.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::renderer {
namespace {

using test::HandScene;
using Filters = trace::RayScene::Filters;

constexpr std::uint32_t kSamples = 4;

LightTransport transport_of(const std::shared_ptr<const scene::Scene>& scene, bool all,
                            Filters filters = Filters::kWhereMasked) {
  TransportOptions options;
  options.all_effects = all;
  return {scene, trace::RayScene::build(scene, 1, filters).value(), options};
}

bool same(const glm::vec3& a, const glm::vec3& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

// Paths whose light differs in some bit, camera rays and surface points of every instance, every entry point.
std::size_t count_different(const LightTransport& a, const LightTransport& b, const Camera& camera) {
  std::size_t different = 0;
  const auto check = [&](const auto& draw, std::uint32_t key, std::uint32_t sample) {
    Sampler first(5, key, sample), second(5, key, sample);
    const bool equal = same(draw(a, first), draw(b, second));
    different += equal && first.next_1d() == second.next_1d() ? 0 : 1;  // as many random numbers drawn, too
  };
  const Viewport viewport{24, 14};
  const glm::vec3 eye(camera.position - a.rays().scene().origin);
  for (std::uint32_t pixel = 0; pixel < viewport.width * viewport.height; ++pixel)
    for (std::uint32_t n = 0; n < kSamples; ++n) {
      const float x = static_cast<float>(pixel % viewport.width), y = static_cast<float>(pixel / viewport.width);
      const trace::Ray ray{eye, 0, ray_direction(camera, viewport, x + 0.5f, y + 0.5f), 1e30f};
      check([&](const auto& t, auto& s) { return t.full_radiance(ray, s); }, pixel, n);
      check([&](const auto& t, auto& s) { return t.view_independent_radiance(ray, s); }, pixel, n);
    }
  for (std::uint32_t i = 0; i < a.rays().instance_count(); ++i)
    for (std::uint32_t n = 0; n < kSamples; ++n) {
      const auto triangles = static_cast<std::uint32_t>(a.rays().instance(i).mesh->triangles.size());
      const SurfacePoint point{i, n * 7 % triangles, 0.3f, 0.2f, n % 2 == 0};
      check([&](const auto& t, auto& s) { return t.view_independent(point, s).sum(); }, i, n);
      check([&](const auto& t, auto& s) { return t.sharp_light(point, s); }, i, n);
      check([&](const auto& t, auto& s) { return t.soft_light(point, s); }, i, n);
      check([&](const auto& t, auto& s) { return t.irradiance(point, s).sum(); }, i, n);
      check([&](const auto& t, auto& s) { return t.view_dependent(point, eye, s).radiance; }, i, n);
      check([&](const auto& t, auto&) { return t.diffuse_albedo(point) + t.emission(point); }, i, n);
    }
  return different;
}

// A box lit from within, things in it, and what `edit` makes of them.
HandScene room(const std::function<void(scene::Scene&, scene::Material& thing)>& edit) {
  HandScene hand;
  const auto walls = hand.material(HandScene::matte({0.7f, 0.6f, 0.5f}));
  const auto lamp = hand.material(HandScene::matte({0, 0, 0}, {8, 8, 6}));
  const auto thing = hand.material(HandScene::matte({0.3f, 0.5f, 0.8f}));
  hand.box({-2, 0, -2}, {2, 3, 2}, walls, true);
  hand.quad({-0.5f, 2.9f, -0.5f}, {1, 0, 0}, {0, 0, 1}, lamp);
  hand.box({-0.6f, 0.4f, -0.6f}, {0.5f, 1.5f, 0.5f}, thing, false);
  edit(hand.scene, hand.scene.materials[thing]);
  return hand;
}

Camera into_the_room() { return look_at({0.2, 1.4, 1.9}, {0, 1, 0}, 70); }

void give_texture(scene::Scene& scene, scene::TextureRef& texture) {
  scene::Image image;
  image.width = image.height = 8;
  for (std::uint32_t i = 0; i < 8 * 8 * 4; ++i) image.pixels.push_back(static_cast<std::uint8_t>(i * 37 + 90));
  scene.images.push_back(image);
  texture.image = static_cast<std::int32_t>(scene.images.size()) - 1;
}

struct Case {
  const char* name;
  std::function<void(scene::Scene&, scene::Material&)> edit;
  Effects needed;  // beside emitters
};

std::vector<Case> cases() {
  const auto sun = [](scene::Scene& s, float diameter) {
    scene::Light light;
    light.kind = scene::LightKind::kDirectional;
    light.angular_diameter = diameter;
    s.lights.push_back(light);
  };
  return {
      {"diffuse", [](auto&, auto&) {}, {}},
      {"delta_sun", [=](auto& s, auto&) { sun(s, 0); }, {.suns = true}},
      {"disc_sun", [=](auto& s, auto&) { sun(s, 0.1f); }, {.suns = true}},
      {"point_light",
       [](auto& s, auto&) {
         s.lights.emplace_back();
         s.lights.back().position = {1, 2, 1};
       },
       {.lamps = true}},
      {"sky", [](auto& s, auto&) { s.sky = {glm::vec3(1), glm::vec3(2), glm::vec3(1)}; }, {.sky = true}},
      {"plastic", [](auto&, auto& m) { m.ior = 1.5f; }, {.glossy = true}},
      {"metal", [](auto&, auto& m) { m.metallic = 1, m.roughness = 0.3f; }, {.glossy = true}},
      {"texture", [](auto& s, auto& m) { give_texture(s, m.base_color_texture); }, {.textures = true}},
      {"normal_map",
       [](auto& s, auto& m) {
         give_texture(s, m.normal_texture);
         for (auto& mesh : s.meshes) mesh.tangents.assign(mesh.positions.size(), glm::vec4(0.6f, 0.8f, 0, 1));
       },
       {.normal_maps = true, .textures = true}},
      {"vertex_colours",
       [](auto& s, auto&) { s.meshes.back().colors.assign(4, glm::vec4(0.4f, 0.9f, 0.2f, 1)); },
       {.textures = true}},
      {"unlit", [](auto&, auto& m) { m.unlit = true; }, {}},
      {"mask",
       [](auto& s, auto& m) {
         give_texture(s, m.base_color_texture);
         m.alpha_mode = scene::AlphaMode::kMask;
       },
       {.textures = true}},
      {"blend",
       [](auto&, auto& m) { m.alpha_mode = scene::AlphaMode::kBlend, m.base_color.w = 0.4f; },
       {.straight = true}},
      {"thin_glass",
       [](auto&, auto& m) { m.transmission = 0.8f, m.roughness = 0, m.ior = 1.5f; },
       {.straight = true, .glossy = true, .transmission = true}},
      {"glass_body",
       [](auto&, auto& m) {
         m.transmission = 1, m.roughness = 0.2f, m.ior = 1.5f, m.thickness = 1;
         m.attenuation_color = {0.5f, 0.9f, 0.5f}, m.attenuation_distance = 0.5f;
       },
       {.glossy = true, .transmission = true}},
  };
}

TEST(EffectIntegrators, the_planned_one_gives_the_light_of_the_one_with_everything_bit_by_bit) {
  for (const auto& c : cases()) {
    const auto scene = room(c.edit).share();
    const auto planned = transport_of(scene, false);
    const auto all = transport_of(scene, true);
    EXPECT_EQ(all.effects(), kAllEffects);
    Effects needed = c.needed;
    needed.emitters = true;
    EXPECT_EQ(effects_of(planned.plan()), needed) << c.name;
    EXPECT_EQ(count_different(planned, all, into_the_room()), 0u) << c.name;
    const auto filtered = transport_of(scene, true, Filters::kEverywhere);
    EXPECT_EQ(count_different(planned, filtered, into_the_room()), 0u) << c.name << ", filters everywhere";
  }
}

TEST(EffectIntegrators, so_it_does_on_scenes_from_files) {
  struct File {
    std::filesystem::path path;
    Camera camera;
  };
  const std::filesystem::path shared = DARM_SHARED_SCENES;
  const std::vector<File> files = {
      {std::filesystem::path(DARM_SOURCE_DIR) / "config/scenes/default.glb",
       look_at({-3, 1.9, 1.4}, {-6, 1.5, -0.1}, 50)},
      {shared / "scenes/cornell_box.glb", look_at({0, 1, 3.2}, {0, 1, 0}, 40)},
      {shared / "scenes/cornell_mirror.glb", look_at({-0.5, 0.9, 1.9}, {-0.2, 0.55, -0.4}, 45)},
      {shared / "features/transmission_test.glb", look_at({0, 0.3, 2.6}, {-0.08, 0.15, 0.3}, 35)},
      {shared / "features/alpha_blend_mode_test.glb", look_at({0, 2, 8}, {0, 1, 0}, 45)},
      {shared / "scenes/sponza.glb", look_at({-10, 1.5, -0.3}, {10, 4, 0}, 60)},
  };
  for (const auto& file : files) {
    if (!std::filesystem::exists(file.path)) continue;
    scene::LightSetup setup;
    setup.sky = scene::Sky{glm::vec3(300), glm::vec3(320), glm::vec3(100)};
    setup.sun = scene::Sun{{0.3f, -1, 0.15f}, glm::vec3(3000), 0.53f};
    const auto scene = scene::load_scene(file.path, setup);
    ASSERT_TRUE(scene) << scene.error().message;
    const auto rays = trace::RayScene::build(*scene, 1).value();
    TransportOptions everything;
    everything.all_effects = true;
    const LightTransport planned(*scene, rays), all(*scene, rays, everything);
    EXPECT_EQ(count_different(planned, all, file.camera), 0u) << file.path;
  }
}

EffectCounts counted(const std::function<void()>& work) {
  const auto before = effect_counts();
  work();
  auto after = effect_counts();
  for (std::size_t i = 0; i < after.size(); ++i) after[i] -= before[i];
  return after;
}

TEST(EffectIntegrators, a_diffuse_scene_runs_no_code_of_an_effect_that_it_lacks) {
  const auto scene = room([](auto&, auto&) {}).share();
  const auto planned = transport_of(scene, false);
  const auto all = transport_of(scene, true, Filters::kEverywhere);
  const auto of = [](const EffectCounts& counts, EffectKind kind) { return counts[static_cast<std::size_t>(kind)]; };
  const auto own = counted([&] { (void)count_different(planned, planned, into_the_room()); });
  const auto others = counted([&] { (void)count_different(all, all, into_the_room()); });
  for (std::size_t i = 0; i < kEffectKinds; ++i) {
    const auto kind = static_cast<EffectKind>(i);
    const bool has = kind == EffectKind::kAreaLights || kind == EffectKind::kDiffuseReflection;
    EXPECT_EQ(own[i] > 0, has) << label_of(kind) << " ran " << own[i] << " times";
  }
  // That the counters can tell: with everything on, the code of what the scene lacks does run.
  for (const auto kind :
       {EffectKind::kAlphaTest, EffectKind::kBlending, EffectKind::kGlossyReflection, EffectKind::kTransmission})
    EXPECT_GT(of(others, kind), 0u) << label_of(kind);
}

TEST(EffectIntegrators, a_change_of_the_scene_changes_plan_and_light_at_once) {
  const auto before = room([](auto&, auto&) {});
  const auto plain = transport_of(before.share(), false);
  EXPECT_FALSE(plain.effects().lamps || plain.effects().straight || plain.effects().transmission);

  auto lit = before;
  lit.scene.lights.emplace_back();
  lit.scene.lights.back().position = {1, 2, 1};
  lit.scene.lights.back().intensity = glm::vec3(50);
  auto moved = lit;
  moved.scene.lights.back().position = {-1, 0.5f, -1};
  auto clear = before;
  clear.scene.materials.back().transmission = 0.9f;
  clear.scene.materials.back().roughness = 0;
  auto animated = before;
  animated.scene.objects.push_back({"thing", true});

  const auto with_lamp = transport_of(lit.share(), false);
  EXPECT_TRUE(with_lamp.effects().lamps);
  const auto with_glass = transport_of(clear.share(), false);
  EXPECT_TRUE(with_glass.effects().straight && with_glass.effects().transmission);
  EXPECT_TRUE(transport_of(animated.share(), false).plan().moving_bodies);
  EXPECT_FALSE(plain.plan().moving_bodies);

  EXPECT_GT(count_different(plain, with_lamp, into_the_room()), 100u);
  EXPECT_GT(count_different(with_lamp, transport_of(moved.share(), false), into_the_room()), 100u);
  EXPECT_GT(count_different(plain, with_glass, into_the_room()), 100u);
  for (const auto& changed : {lit, moved, clear})
    EXPECT_EQ(
        count_different(transport_of(changed.share(), false), transport_of(changed.share(), true), into_the_room()),
        0u);
}

TEST(EffectIntegrators, every_plan_gets_the_first_that_covers_it_and_none_stands_behind_one_that_holds_it) {
  std::vector<Effects> compiled;
  for (const auto& c : plain_integrators()) compiled.push_back(c.effects);
  for (const auto& c : textured_integrators()) compiled.push_back(c.effects);
  for (std::size_t i = 0; i < compiled.size(); ++i) {
    EXPECT_EQ(smallest_cover(compiled[i]).effects, compiled[i]) << to_string(compiled[i]);
    for (std::size_t k = 0; k < i; ++k) EXPECT_FALSE(compiled[k].cover(compiled[i])) << to_string(compiled[i]);
  }
  for (unsigned bits = 0; bits < 512; ++bits) {
    const auto on = [&](unsigned i) { return (bits >> i & 1u) != 0; };
    const Effects needed{on(0), on(1), on(2), on(3), on(4), on(5), on(6), on(7), on(8)};
    EXPECT_TRUE(smallest_cover(needed).effects.cover(needed)) << to_string(needed);
  }
}

TEST(EffectIntegrators, costs_are_measured_on_equal_paths_and_for_each_effect_that_can_be_taken_out) {
  const auto scene = room([](auto& s, auto& m) {
                       m.ior = 1.5f;
                       s.sky = {glm::vec3(1), glm::vec3(1), glm::vec3(1)};
                     }).share();
  const auto transport = transport_of(scene, false);
  const CostView view{into_the_room(), {16, 8}, 0.02};
  const auto plan = measure_plan(transport, view, 1).value();
  EXPECT_EQ(plan.planned.different, 0u);
  EXPECT_GT(plan.planned.paths, 0u);
  EXPECT_GT(plan.planned.ratio, 0.2);
  EXPECT_LE(plan.planned.low, plan.planned.high);
  const auto costs = measure_effects(transport, view, 1).value();
  std::vector<std::string> names;
  for (const auto& cost : costs) names.push_back(cost.effect);
  EXPECT_EQ(names, (std::vector<std::string>{"area lights", "sky", "glossy reflection"}));
  for (const auto& name : names)
    for (const auto& effect : scene::plan_effects(*scene::without_effect(*scene, name)).effects)
      if (effect.name == name) {
        EXPECT_FALSE(effect.needed) << name;
      }
  EXPECT_EQ(scene::without_effect(*scene, "moving bodies"), nullptr);
}

}  // namespace
}  // namespace darm::renderer
