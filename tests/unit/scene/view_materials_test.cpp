// Which materials are worth a private layer, and how fine.
#include "actors/scene/view_materials.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

namespace darm::scene {
namespace {

Material plaster(float roughness) {
  Material m;
  m.base_color = glm::vec4(0.7f, 0.7f, 0.7f, 1.0f);
  m.metallic = 0;
  m.roughness = roughness;
  return m;
}

Material mirror() {
  Material m;
  m.metallic = 1;
  m.roughness = 0.02f;
  return m;
}

Scene scene_of(const std::vector<Material>& materials) {
  Scene s;
  s.materials = materials;
  s.objects.emplace_back();
  for (std::uint32_t i = 0; i < materials.size(); ++i) {
    s.meshes.emplace_back().material = i;
    s.instances.push_back({i, glm::mat4(1.0f), false, 0});
  }
  return s;
}

TEST(ViewMaterials, a_scene_of_matte_surfaces_has_no_private_layer) {
  Material matte = plaster(1);
  matte.ior = 1;
  Material unlit = mirror();
  unlit.unlit = true;
  Material dark = plaster(0.8f);
  dark.base_color = glm::vec4(0.02f, 0.02f, 0.02f, 1.0f);
  const auto weights = view_materials(scene_of({plaster(0.9f), plaster(1.0f), matte, unlit, dark}));
  EXPECT_FALSE(calls_for_view_layer(weights));
  for (const auto& m : weights) EXPECT_EQ(m.weight, 0.0f);
  EXPECT_GT(weights[0].squared_omitted(0.5f), 0.005f * 0.005f) << "its sheen is left out, and told";
  EXPECT_EQ(weights[2].squared_omitted(0.5f), 0.0f);
  EXPECT_EQ(weights[3].squared_omitted(0.5f), 0.0f);
}

TEST(ViewMaterials, beside_a_mirror_rough_surfaces_join_at_coarse_levels) {
  Material matte = plaster(1);
  matte.ior = 1;
  const auto weights = view_materials(scene_of({plaster(0.9f), mirror(), matte}));
  ASSERT_TRUE(calls_for_view_layer(weights));
  EXPECT_GT(weights[1].weight, 5 * weights[0].weight);
  EXPECT_LT(std::sqrt(weights[1].squared_omitted(0.5f)), weights[1].weight)
      << "worth more than it shows in the mean: it is sharp";
  EXPECT_NEAR(weights[1].diffuse, 0.0f, 1e-6f) << "metal";
  EXPECT_EQ(weights[1].coarser, 0);
  EXPECT_GT(weights[0].weight, 0.0f);
  EXPECT_EQ(weights[0].coarser, 3);
  EXPECT_EQ(weights[2].weight, 0.0f) << "nothing is reflected without a boundary";
}

TEST(ViewMaterials, a_smooth_coat_lacks_more_the_flatter_it_is_looked_at) {
  Material dark = plaster(0.1f);
  dark.base_color = glm::vec4(0.02f, 0.02f, 0.02f, 1.0f);
  const auto floor = view_material(scene_of({dark}), dark);
  for (float c = 0.1f; c < 1; c += 0.1f) EXPECT_LE(floor.squared_omitted(c + 0.1f), floor.squared_omitted(c)) << c;
  EXPECT_GT(floor.squared_omitted(0.1f), 16 * floor.squared_omitted(0.9f));
  EXPECT_EQ(floor.squared_omitted(-1), floor.squared_omitted(0));
  EXPECT_EQ(floor.squared_omitted(2), floor.squared_omitted(1));
  EXPECT_EQ(floor.squared_omitted(NAN), floor.squared_omitted(0));
}

// A plain 4 m under the eye, 20 m away: cosine 0.2. Its coat of ior 1.5 reflects 4 % straight on, 35.5 % there, 8.6 %
// in the mean, so that 0.7 of white under it shows .494; rough, it returns about 5 % of what it kept.
TEST(ViewMaterials, a_rough_coat_darkens_what_is_looked_at_flatly) {
  const auto rough = view_material(scene_of({plaster(1)}), plaster(1));
  const auto code = [](double x) { return 1.055 * std::pow(x, 1 / 2.4) - 0.055; };
  const double light = double{kGreySurroundings};
  const double shared = 0.7 * (1 - 0.04 - 0.96 / 21);
  const double seen = 0.7 * (1 - 0.355) + 0.045;
  EXPECT_NEAR(std::sqrt(rough.squared_omitted(0.2f)), code(light * shared) - code(light * seen), 0.015);
  EXPECT_LT(rough.squared_omitted(0.6f), 0.02f * 0.02f);
}

TEST(ViewMaterials, a_surface_that_reflects_all_is_no_fault) {
  Material all = plaster(0.5f);
  all.ior = 0;  // glTF's way to say so
  const auto known = view_material(scene_of({all}), all);
  for (float c = 0.05f; c < 1; c += 0.1f) {
    EXPECT_GT(known.squared_omitted(c), 0.0f);
    EXPECT_LT(known.squared_omitted(c), 0.9f) << "not what NaN is clamped to";
  }
}

TEST(ViewMaterials, what_the_client_draws_behind_a_thin_pane_is_not_lacking) {
  Material pane = plaster(0.3f);
  pane.base_color = glm::vec4(1);
  pane.transmission = 1;
  Material block = pane;
  block.thickness = 0.1f;
  const auto lacks = [](const Material& m) { return view_material(scene_of({m}), m).squared_omitted(0.9f); };
  EXPECT_LT(lacks(pane), 0.01f);
  EXPECT_GT(lacks(block), 4 * lacks(pane)) << "it refracts";
}

TEST(ViewMaterials, a_pane_passes_the_mean_of_what_its_textures_let_through) {
  Material pane = plaster(0);
  pane.base_color = glm::vec4(1, 0.5f, 0, 1);
  pane.transmission = 0.8f;
  auto scene = scene_of({pane});
  const auto near = [](const glm::vec3& a, const glm::vec3& b) {
    return glm::all(glm::lessThan(glm::abs(a - b), glm::vec3(1e-5f)));
  };
  EXPECT_TRUE(near(mean_passage(scene, pane), {0.8f, 0.4f, 0}));
  pane.metallic = 0.5f;
  EXPECT_TRUE(near(mean_passage(scene, pane), {0.4f, 0.2f, 0}));
  // Stripes: one half is metal, the other is not, and the metal's tint does not count.
  auto& stripes = scene.images.emplace_back();
  stripes.width = 2;
  stripes.height = 1;
  stripes.pixels = {0, 0, 0, 255, 0, 0, 255, 255};
  auto& tint = scene.images.emplace_back(stripes);
  tint.pixels = {255, 188, 0, 255, 255, 255, 255, 255};
  pane.metallic = 1;
  pane.metallic_roughness_texture.image = 0;
  pane.base_color_texture.image = 1;
  const glm::vec3 passed = mean_passage(scene, pane);
  EXPECT_NEAR(passed.x, 0.4f, 1e-5f);
  EXPECT_NEAR(passed.y, 0.4f * 0.5f * 0.503f, 1e-3f) << "sRGB 188 is linear .503";
  pane.thickness = 0.1f;
  EXPECT_EQ(mean_passage(scene, pane), glm::vec3(0.0f)) << "a volume refracts";
}

TEST(ViewMaterials, polish_metal_and_glass_call_for_it) {
  Material pane = plaster(0);
  pane.transmission = 1;
  Material ball = pane;
  ball.thickness = 0.1f;
  Material brass = mirror();
  brass.roughness = 0.35f;
  for (const auto& m : {plaster(0.05f), pane, ball, brass})
    EXPECT_TRUE(calls_for_view_layer(view_materials(scene_of({m}))));
}

TEST(ViewMaterials, textures_are_read_not_guessed) {
  Scene s = scene_of({plaster(1)});
  s.materials[0].metallic = 1;  // glTF's default factor, undone by the texture
  s.images.push_back({"rough", 2, 2, std::vector<std::uint8_t>(16, 0)});
  s.materials[0].metallic_roughness_texture.image = 0;
  for (std::size_t i = 0; i < 16; i += 4) s.images[0].pixels[i + 1] = 255;  // rough, not metallic
  EXPECT_FALSE(calls_for_view_layer(view_materials(s)));
  for (std::size_t i = 0; i < 16; i += 4) s.images[0].pixels[i + 2] = 255;
  EXPECT_TRUE(calls_for_view_layer(view_materials(s)));
}

}  // namespace
}  // namespace darm::scene
