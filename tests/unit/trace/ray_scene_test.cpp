#include "actors/renderer/trace/ray_scene.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <random>

#include "actors/renderer/trace/surface.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::renderer::trace {
namespace {

using test::HandScene;

Ray ray(glm::vec3 o, glm::vec3 d) { return {o, 0.0f, d, 1e30f}; }

scene::Image checker() {  // 2x2 texels, alpha 0 / 255
  scene::Image image;
  image.width = image.height = 2;
  image.pixels = {255, 255, 255, 0, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 0};
  return image;
}

TEST(RayScene, names_the_point_and_the_side_that_is_hit) {
  HandScene hand;
  hand.quad({0, 0, 0}, {2, 0, 0}, {0, 2, 0}, hand.material(HandScene::matte(glm::vec3(0.5f))));
  const auto scene = hand.rays();
  Hit hit;
  ASSERT_TRUE(scene->closest(ray({1.5f, 0.5f, 3}, {0, 0, -1}), hit));
  EXPECT_NEAR(hit.t, 3, 1e-5);
  EXPECT_TRUE(hit.front);
  const Surface s = make_surface(*scene, hit);
  EXPECT_NEAR(glm::length(s.position - glm::vec3(1.5f, 0.5f, 0)), 0, 1e-5);
  EXPECT_GT(s.geometric_normal.z, 0.999f);
  EXPECT_NEAR(s.area, 2, 1e-5);
  ASSERT_TRUE(scene->closest(ray({1.5f, 0.5f, -3}, {0, 0, 1}), hit));
  EXPECT_FALSE(hit.front);
  EXPECT_LT(make_surface(*scene, hit).normal.z, -0.999f);
}

TEST(RayScene, a_mirrored_instance_keeps_its_front_where_its_normals_point) {
  HandScene hand;
  hand.quad({0, 0, 0}, {2, 0, 0}, {0, 2, 0}, hand.material(HandScene::matte(glm::vec3(0.5f))));
  hand.scene.instances[0].to_world = glm::scale(glm::mat4(1.0f), glm::vec3(-1, 1, 1));
  hand.scene.instances[0].flipped = true;
  const auto scene = hand.rays();
  Hit hit;
  ASSERT_TRUE(scene->closest(ray({-1.5f, 0.5f, 3}, {0, 0, -1}), hit));
  EXPECT_TRUE(hit.front);
  EXPECT_GT(glm::dot(make_surface(*scene, hit).geometric_normal, glm::vec3(0, 0, 1)), 0.999f);
  EXPECT_GT(glm::dot(make_surface(*scene, hit).shading_normal, glm::vec3(0, 0, 1)), 0.999f);
}

TEST(RayScene, a_camera_looks_through_single_sided_backs_and_other_rays_do_not) {
  HandScene hand;
  const auto single = hand.material(HandScene::matte(glm::vec3(0.5f)));
  auto both = HandScene::matte(glm::vec3(0.5f));
  both.double_sided = true;
  const auto twofold = hand.material(both);
  hand.quad({-1, -1, 0}, {0, 2, 0}, {2, 0, 0}, single);  // its back looks along +z
  hand.quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, single);  // in the same plane: its front looks along +z
  hand.quad({-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, single);  // a back in front of both
  hand.quad({3, -1, 0}, {0, 2, 0}, {2, 0, 0}, twofold);
  const auto scene = hand.rays();
  Hit hit;
  ASSERT_TRUE(scene->closest(ray({0.3f, 0.2f, 3}, {0, 0, -1}), hit));
  EXPECT_EQ(hit.instance, 2u);
  EXPECT_FALSE(hit.front);
  ASSERT_TRUE(scene->closest_camera(ray({0.3f, 0.2f, 3}, {0, 0, -1}), hit));
  EXPECT_EQ(hit.instance, 1u);
  EXPECT_TRUE(hit.front);
  EXPECT_TRUE(scene->occluded({{0.3f, 0.2f, 3}, 0, {0, 0, -1}, 2.5f}));
  ASSERT_TRUE(scene->closest_camera(ray({4, 0, 3}, {0, 0, -1}), hit));
  EXPECT_FALSE(hit.front);
}

TEST(RayScene, alpha_mask_lets_rays_pass_below_the_cutoff) {
  HandScene hand;
  hand.scene.images.push_back(checker());
  auto cut = HandScene::matte(glm::vec3(0.5f));
  cut.alpha_mode = scene::AlphaMode::kMask;
  cut.base_color_texture.image = 0;
  cut.base_color_texture.nearest = true;
  hand.quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, hand.material(cut));
  const auto scene = hand.rays();
  EXPECT_TRUE(scene->has_masks());
  Hit hit;
  for (const auto& [x, y, solid] :
       {std::tuple{0.25f, 0.25f, false}, {0.75f, 0.25f, true}, {0.25f, 0.75f, true}, {0.75f, 0.75f, false}}) {
    EXPECT_EQ(scene->closest(ray({x, y, 1}, {0, 0, -1}), hit), solid);
    EXPECT_EQ(scene->closest_camera(ray({x, y, 1}, {0, 0, -1}), hit), solid);
    EXPECT_EQ(scene->occluded(ray({x, y, 1}, {0, 0, -1})), solid);
  }
}

TEST(RayScene, bad_rays_and_empty_scenes_hit_nothing) {
  HandScene hand;
  hand.quad({-1e3f, -1e3f, 0}, {2e3f, 0, 0}, {0, 2e3f, 0}, hand.material(HandScene::matte(glm::vec3(0.5f))));
  const auto scene = hand.rays();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  Hit hit;
  for (const float bad : {nan, inf, -inf}) {
    for (const auto& r : {ray({bad, 0, 1}, {0, 0, -1}), ray({0, 0, 1}, {0, bad, -1}), ray({0, 0, bad}, {0, 0, bad})}) {
      EXPECT_FALSE(scene->closest(r, hit));
      EXPECT_FALSE(scene->closest_camera(r, hit));
      EXPECT_FALSE(scene->occluded(r));
    }
  }
  EXPECT_FALSE(scene->closest(ray({0, 0, 1}, {0, 0, 0}), hit));
  EXPECT_FALSE(scene->closest({{0, 0, 1}, nan, {0, 0, -1}, 10}, hit));
  const auto empty = HandScene().rays();
  EXPECT_FALSE(empty->closest(ray({0, 0, 1}, {0, 0, -1}), hit));
  EXPECT_FALSE(empty->occluded(ray({0, 0, 1}, {0, 0, -1})));
}

TEST(RayScene, broken_indices_are_refused) {
  HandScene hand;
  hand.quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, hand.material(HandScene::matte(glm::vec3(0.5f))));
  hand.scene.meshes[0].triangles[1].z = 99;
  EXPECT_FALSE(RayScene::build(hand.share(), 1).has_value());
  auto stray = std::make_shared<scene::Scene>(hand.scene);
  stray->instances[0].mesh = 7;
  EXPECT_FALSE(RayScene::build(stray, 1).has_value());
}

// Rays that start on a surface neither hit it again nor miss what lies behind it, near the origin and far from it.
TEST(RayScene, spawned_rays_do_not_hit_their_own_surface) {
  for (const float far : {0.0f, 100.0f, 1e5f}) {
    HandScene hand;
    const auto m = hand.material(HandScene::matte(glm::vec3(0.5f)));
    const glm::vec3 a(far, far * 0.7f, -far);
    hand.quad(a, {3, 1, 0.5f}, {-0.2f, 2, 1}, m);
    const auto scene = hand.rays();
    std::mt19937 random(7);
    std::uniform_real_distribution<float> uniform(0, 1);
    int wrong = 0;
    for (int i = 0; i < 20000; ++i) {
      float u = uniform(random), v = uniform(random);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const Surface s = make_surface(*scene, SurfacePoint{0, static_cast<std::uint32_t>(i & 1), u, v, true});
      glm::vec3 d = glm::normalize(glm::vec3(uniform(random), uniform(random), uniform(random)) * 2.0f - 1.0f);
      if (glm::dot(d, s.geometric_normal) < 0) d = -d;
      if (glm::dot(d, s.geometric_normal) < 1e-3f) continue;
      wrong += scene->occluded(ray(spawn_origin(s, d), d)) ? 1 : 0;
      wrong += scene->occluded(ray(spawn_origin(s, -d), -d)) ? 1 : 0;
    }
    EXPECT_EQ(wrong, 0) << "at " << far;
  }
}

TEST(Surface, normal_map_bends_the_normal_and_the_back_mirrors_it) {
  HandScene hand;
  scene::Image map;
  map.width = map.height = 1;
  map.pixels = {204, 128, 230, 255};  // leans towards +tangent
  hand.scene.images.push_back(map);
  auto m = HandScene::matte(glm::vec3(0.5f));
  m.normal_texture.image = 0;
  m.double_sided = true;
  hand.quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, hand.material(m));
  hand.scene.meshes[0].tangents.assign(4, glm::vec4(1, 0, 0, 1));
  const auto scene = hand.rays();
  const Surface front = make_surface(*scene, SurfacePoint{0, 0, 0.2f, 0.2f, true});
  const Surface back = make_surface(*scene, SurfacePoint{0, 0, 0.2f, 0.2f, false});
  EXPECT_GT(front.normal.x, 0.4f);
  EXPECT_GT(front.normal.z, 0.7f);
  EXPECT_NEAR(glm::length(front.normal), 1, 1e-5);
  EXPECT_NEAR(glm::length(front.normal + back.normal), 0, 1e-5);
}

}  // namespace
}  // namespace darm::renderer::trace
