// The shared test scenes load with the counts their README states; the broken ones end in one clear error.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <numeric>

#include "actors/scene/effect_plan.hpp"
#include "actors/scene/gltf_loader.hpp"
#include "actors/scene/primitive_data.hpp"

namespace darm::scene {
namespace {

const std::filesystem::path kScenes = DARM_SHARED_SCENES;

struct Expected {
  const char* file;
  std::uint64_t triangles;  ///< shown + dropped
  std::size_t materials;    ///< used; one more than the file's where a primitive has none
  std::size_t file_lights;
  std::size_t cameras;
};

void PrintTo(const Expected& e, std::ostream* out) { *out << e.file; }

class ValidScene : public testing::TestWithParam<Expected> {};

TEST_P(ValidScene, LoadsWithTheCountsOfItsReadme) {
  const Expected& e = GetParam();
  if (!std::filesystem::exists(kScenes / e.file)) GTEST_SKIP() << "shared scenes are not here";
  const auto loaded = load_scene(kScenes / e.file, {});
  ASSERT_TRUE(loaded) << loaded.error().message;
  const Scene& scene = **loaded;
  const std::uint64_t dropped = std::accumulate(scene.dropped.begin(), scene.dropped.end(), std::uint64_t{0},
                                                [](std::uint64_t n, const Dropped& d) { return n + d.triangles; });
  EXPECT_EQ(scene.triangle_count() + dropped, e.triangles);
  EXPECT_LE(dropped, 10u);
  EXPECT_EQ(scene.materials.size(), e.materials);
  EXPECT_EQ(scene.cameras.size(), e.cameras);
  std::size_t file_lights = 0;
  for (const Light& l : scene.lights) file_lights += scene.objects.at(l.object).name != "sun";
  EXPECT_EQ(file_lights, e.file_lights);
  for (const Mesh& m : scene.meshes) {
    ASSERT_LT(m.material, scene.materials.size());
    ASSERT_EQ(m.normals.size(), m.positions.size());
    ASSERT_EQ(!m.tangents.empty(), scene.materials[m.material].normal_texture.present());
    for (const auto& n : m.normals) ASSERT_NEAR(n.x * n.x + n.y * n.y + n.z * n.z, 1.0f, 1e-4f);
  }
  for (const Image& i : scene.images) ASSERT_EQ(i.pixels.size(), std::size_t{4} * i.width * i.height);
}

INSTANTIATE_TEST_SUITE_P(Shared, ValidScene,
                         testing::Values(Expected{"scenes/sponza.glb", 262267, 25, 0, 0},
                                         Expected{"scenes/sibenik.glb", 73564, 14, 0, 0},
                                         Expected{"scenes/quake_oacmpdm10.glb", 26613, 68, 114, 1},
                                         Expected{"scenes/chess_board.glb", 178848, 3, 0, 0},
                                         Expected{"scenes/japanese_bridge_garden_meshopt.glb", 21883, 13, 0, 0},
                                         Expected{"scenes/cornell_box.glb", 36, 5, 0, 0},
                                         Expected{"scenes/cornell_mirror.glb", 36, 8, 0, 0},
                                         Expected{"features/chess_board_draco.glb", 178848, 3, 0, 0},
                                         Expected{"features/damaged_helmet.glb", 15452, 1, 0, 0},
                                         Expected{"features/alpha_blend_mode_test.glb", 61, 6, 0, 0},
                                         Expected{"features/transmission_test.glb", 128775, 14, 0, 1},
                                         Expected{"features/lights_punctual_lamp.glb", 6000, 3, 5, 0},
                                         Expected{"features/emissive_strength_test.glb", 90, 6, 0, 0},
                                         Expected{"features/normal_tangent_test.glb", 7774, 1, 0, 0},
                                         Expected{"features/texture_transform_test.glb", 24, 9, 0, 0},
                                         Expected{"features/multi_uv_test.glb", 12, 1, 0, 1},
                                         Expected{"features/negative_scale_test.glb", 7724, 6, 0, 0},
                                         Expected{"features/vertex_color_test.glb", 36, 2, 0, 0},
                                         Expected{"features/mesh_primitive_modes.glb", 16, 1, 0, 0},
                                         Expected{"features/simple_sparse_accessor.glb", 12, 1, 0, 0},
                                         Expected{"features/box_interleaved.glb", 12, 1, 0, 0},
                                         Expected{"features/water_bottle_draco.glb", 4510, 1, 0, 0},
                                         Expected{"features/cesium_milk_truck.glb", 3624, 4, 0, 0},
                                         Expected{"features/box_meshopt_quantized.glb", 12, 1, 0, 0},
                                         Expected{"features/lights_all_types.glb", 12, 1, 4, 1},
                                         Expected{"features/many_cubes.glb", 6012, 1, 0, 1}));

struct Broken {
  const char* file;
  const char* fault;
};

void PrintTo(const Broken& b, std::ostream* out) { *out << b.file; }

class BrokenScene : public testing::TestWithParam<Broken> {};

TEST_P(BrokenScene, EndsInOneLineNamingFileAndFault) {
  const Broken& b = GetParam();
  if (!std::filesystem::exists(kScenes / "invalid" / b.file)) GTEST_SKIP() << "shared scenes are not here";
  const auto loaded = load_scene(kScenes / "invalid" / b.file, {});
  ASSERT_FALSE(loaded);
  EXPECT_THAT(loaded.error().message, testing::HasSubstr(b.file));
  EXPECT_THAT(loaded.error().message, testing::HasSubstr(b.fault));
  EXPECT_EQ(loaded.error().message.find('\n'), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    Shared, BrokenScene,
    testing::Values(
        Broken{"index_out_of_range/IndexOutOfRange.gltf", "primitive 0: index 255 points past its 24 vertices"},
        Broken{"box_with_infinites.glb", "non-finite"},
        Broken{"missing_bin/BoxTextured.gltf", "'BoxTextured0.bin': no such file"},
        Broken{"recursive_nodes.gltf", "cycle"}, Broken{"bounds/invalid-buffer-view-index.gltf", "invalid bufferView"},
        Broken{"buffer_short.glb", "declares 24 bytes, has 12"}, Broken{"truncated_chunk_data.glb", "cut off"},
        Broken{"invalid_magic.glb", "magic"}, Broken{"version_unsupported.gltf", "'3.0'"},
        Broken{"required_extension_unsupported.gltf", "EXT_lights_image_based"}, Broken{"no_scene.gltf", "no scenes"},
        Broken{"image_invalid_data/invalid_image_data.gltf", "image 0"}));

TEST(SharedScenes, GeneratedTangentsAgreeWithThoseOfTheFile) {
  const auto path = kScenes / "features/lights_punctual_lamp.glb";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "shared scenes are not here";
  const auto scene = load_scene(path, {});
  ASSERT_TRUE(scene);
  std::size_t vertices = 0;
  std::size_t agree = 0;
  for (const Mesh& m : (*scene)->meshes) {
    if (m.tangents.empty()) continue;
    std::map<std::string, std::uint64_t> dropped;
    const Mesh made = make_mesh({m.positions, m.normals, {}, m.uvs, {}, m.triangles}, 0, dropped);
    ASSERT_EQ(made.triangles.size(), m.triangles.size());
    for (std::size_t t = 0; t < m.triangles.size(); ++t) {
      const glm::vec4 theirs = m.tangents[m.triangles[t].x];
      const glm::vec4 ours = made.tangents[made.triangles[t].x];
      ++vertices;
      agree += glm::dot(glm::vec3(theirs), glm::vec3(ours)) > 0.8f && theirs.w == ours.w;
    }
  }
  EXPECT_EQ(vertices, 6000u);
  EXPECT_GT(static_cast<double>(agree), 0.99 * static_cast<double>(vertices));
}

TEST(DefaultScene, HasWhatItIsMadeToShowAndNoWarnings) {
  const std::filesystem::path path = std::filesystem::path(DARM_SOURCE_DIR) / "config/scenes/default.glb";
  ASSERT_TRUE(std::filesystem::exists(path));
  EXPECT_LT(std::filesystem::file_size(path), 2u << 20);
  const auto loaded = load_scene(path, {});
  ASSERT_TRUE(loaded) << loaded.error().message;
  const Scene& scene = **loaded;
  EXPECT_TRUE(scene.warnings.empty());
  EXPECT_TRUE(scene.dropped.empty());
  EXPECT_GT(scene.triangle_count(), 10000u);
  EXPECT_EQ(scene.cameras.size(), 4u);
  EXPECT_EQ(scene.lights.size(), 3u);
  const EffectPlan plan = plan_effects(scene);
  EXPECT_TRUE(plan.delta_lights && plan.area_lights && plan.alpha_test && plan.transmission && plan.volume_attenuation);
  EXPECT_TRUE(plan.normal_maps && plan.textures && plan.moving_bodies && plan.moving_lights && plan.glossy_reflection);
}

TEST(SharedScenes, DracoGivesTheSameSceneAsPlain) {
  const auto plain = kScenes / "scenes/chess_board.glb";
  const auto draco = kScenes / "features/chess_board_draco.glb";
  if (!std::filesystem::exists(plain) || !std::filesystem::exists(draco)) GTEST_SKIP() << "shared scenes are not here";
  const auto a = load_scene(plain, {});
  const auto b = load_scene(draco, {});
  ASSERT_TRUE(a && b);
  EXPECT_EQ((*a)->triangle_count(), (*b)->triangle_count());
  EXPECT_NE((*a)->hash, (*b)->hash);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR((*a)->bounds_min[c], (*b)->bounds_min[c], 1e-3f);
    EXPECT_NEAR((*a)->bounds_max[c], (*b)->bounds_max[c], 1e-3f);
  }
}

}  // namespace
}  // namespace darm::scene
