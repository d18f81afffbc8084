#include "actors/renderer/stored_light.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <glm/common.hpp>
#include <limits>

#include "actors/atlas/build_layout.hpp"
#include "actors/renderer/display_curve.hpp"
#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/tile_display.hpp"
#include "actors/renderer/tile_surface_scene.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::renderer {
namespace {

using test::HandScene;

// A closed room of one material, seen from inside.
struct Room {
  explicit Room(const scene::Material& material, float q = 16) {
    HandScene hand;
    hand.box(glm::vec3(-2), glm::vec3(2), hand.material(material), true);
    scene = hand.share();
    rays = trace::RayScene::build(scene, 1).value();
    layout = atlas::build_layout(*scene, {.q = q}).value();
    transport = std::make_unique<LightTransport>(scene, rays);
  }
  [[nodiscard]] StoredLight lit(const StoredTexel& texel) const {
    StoredLight light(layout);
    const std::vector<StoredTexel> tile(kTileTexels, texel);
    for (std::uint32_t t = 0; t < layout->levels.back().tiles_x * layout->levels.back().tiles_y; ++t)
      light.put(t, tile);
    return light;
  }

  std::shared_ptr<const scene::Scene> scene;
  std::shared_ptr<const trace::RayScene> rays;
  std::shared_ptr<const atlas::Layout> layout;
  std::unique_ptr<LightTransport> transport;
};

const SurfacePoint kFloor{0, 0, 0.4f, 0.25f, true};

StoredTexel soft(float light) { return {glm::vec3(0.0f), glm::vec3(light), true}; }
scene::Material matte(float albedo) { return HandScene::matte(glm::vec3(albedo)); }

TEST(StoredLight, EveryPointOfALitSurfaceIsKnown) {
  const Room room(matte(0.5f));
  const auto light = room.lit({glm::vec3(1, 0, 2), glm::vec3(0, 2, 1), true});
  for (std::uint32_t instance = 0; instance < room.scene->instances.size(); ++instance)
    for (const auto& [u, v] : {std::pair{0.01f, 0.01f}, {0.98f, 0.01f}, {0.01f, 0.98f}, {0.3f, 0.3f}})
      for (const float xi : {0.0f, 0.999f}) {
        const auto s = trace::make_surface(*room.rays, SurfacePoint{instance, 0, u, v, true});
        const auto* found = light.find(s, {xi, xi});
        ASSERT_NE(found, nullptr) << instance << " " << u << " " << v << " " << xi;
        EXPECT_EQ(found->sharp + found->soft, glm::vec3(1, 2, 3));
      }
}

TEST(StoredLight, WhatIsNotLightIsNotKnown) {
  const Room room(matte(0.5f));
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const auto s = trace::make_surface(*room.rays, kFloor);
  const glm::vec3 one(1.0f);
  for (const StoredTexel& bad :
       {StoredTexel{one, one, false}, StoredTexel{{nan, 0, 0}, one, true}, StoredTexel{one, {0, inf, 0}, true},
        StoredTexel{{0, 0, -1}, one, true}, StoredTexel{one, {0, -1e-9f, 0}, true}})
    EXPECT_EQ(room.lit(bad).find(s, {0.5f, 0.5f}), nullptr);
}

TEST(StoredLight, TheOtherSideIsNotThisOne) {
  const Room room(matte(0.5f));
  auto s = trace::make_surface(*room.rays, kFloor);
  s.front = false;  // single-sided: the back has no texels
  EXPECT_EQ(room.lit(soft(1.0f)).find(s, {0.5f, 0.5f}), nullptr);
}

TEST(StoredLight, APathEndsInItAtTheFirstDiffuseSurface) {
  const Room room(matte(0.5f));
  const auto light = room.lit(soft(2.0f));
  for (std::uint32_t i = 0; i < 200; ++i) {
    Sampler sampler(3, 7, i);
    const float soft = room.transport->soft_light(kFloor, sampler, &light).x;
    // Near the corners a ray is too short for coarse texels and goes on: then it meets the next wall's.
    EXPECT_TRUE(std::abs(soft - 1.0f) < 1e-5f || soft <= 0.5f + 1e-5f) << soft;
  }
}

// Light that rises along the coarse level's rows and columns.
StoredTexel slope(float x, float y) { return {glm::vec3(x + 3 * y), glm::vec3(2 * x + y), true}; }

StoredLight sloping(const std::shared_ptr<const atlas::Layout>& layout) {
  StoredLight light(layout);
  const auto& level = layout->levels.back();
  for (std::uint32_t t = 0; t < level.tiles_x * level.tiles_y; ++t) {
    std::vector<StoredTexel> tile;
    for (int i = 0; i < kTileTexels; ++i)
      tile.push_back(slope(static_cast<float>(t % level.tiles_x * kTileSize) + static_cast<float>(i % kTileSize),
                           static_cast<float>(t / level.tiles_x * kTileSize) + static_cast<float>(i / kTileSize)));
    light.put(t, tile);
  }
  return light;
}

TEST(StoredLight, GuessOfAFinerLevelIsTheBilinearValueAtTheSameSurfacePoint) {
  const Room room(matte(0.5f), 128);
  const int coarse = room.layout->coarse_level();
  ASSERT_GE(coarse, 1);
  const auto light = sloping(room.layout);
  for (std::uint32_t instance = 0; instance < room.scene->instances.size(); ++instance) {
    const PatchId patch = room.layout->patch_of(instance, 0, true);
    const glm::vec2 uv = room.layout->patch_uv(instance, 0, 0.31f, 0.27f);
    const auto guess = light.guess(patch, 0, room.layout->texel_at(patch, 0, uv));
    ASSERT_TRUE(guess);
    const glm::vec2 at = room.layout->texel_at(patch, coarse, uv) - 0.5f;
    const auto truth = slope(at.x, at.y);
    EXPECT_NEAR(guess->sharp.x, truth.sharp.x, 1e-3f * truth.sharp.x);
    EXPECT_NEAR(guess->soft.y, truth.soft.y, 1e-3f * truth.soft.y);
    // Four texels a step of 1 and of 3 apart, with bilinear weights: the variance is a (1 - a) + 9 b (1 - b).
    const glm::vec2 part = glm::fract(at);
    EXPECT_NEAR(guess->sharp_spread, part.x * (1 - part.x) + 9 * part.y * (1 - part.y), 0.01f);
  }
}

TEST(StoredLight, GuessLeavesOutWhatIsNotKnown) {
  const Room room(matte(0.5f), 128);
  StoredLight light(room.layout);
  const PatchId patch = room.layout->patch_of(0, 0, true);
  const glm::vec2 uv = room.layout->patch_uv(0, 0, 0.3f, 0.3f);
  const glm::vec2 fine = room.layout->texel_at(patch, 0, uv);
  EXPECT_FALSE(light.guess(patch, 0, fine));
  // Of the four texels around the place only the nearest is known: its value, and no spread.
  const auto& level = room.layout->levels.back();
  const auto at = glm::uvec2(room.layout->texel_at(patch, room.layout->coarse_level(), uv));
  std::vector<StoredTexel> tile(kTileTexels);
  tile[at.y % kTileSize * kTileSize + at.x % kTileSize] = {glm::vec3(4.0f), glm::vec3(5.0f), true};
  light.put(at.y / kTileSize * level.tiles_x + at.x / kTileSize, tile);
  const auto guess = light.guess(patch, 0, fine);
  ASSERT_TRUE(guess);
  EXPECT_FLOAT_EQ(guess->sharp.x, 4.0f);
  EXPECT_FLOAT_EQ(guess->soft.x, 5.0f);
  EXPECT_NEAR(guess->sharp_spread, 0.0f, 1e-5f);
  EXPECT_FALSE(guess->surrounded) << "that light is smooth is not known";
}

TEST(StoredLight, AGuessIsAsSureAsLightIsSmoothAround) {
  const Room room(matte(0.5f), 128);
  const PatchId patch = room.layout->patch_of(0, 0, true);
  const glm::vec2 uv = room.layout->patch_uv(0, 0, 0.3f, 0.3f);
  const glm::vec2 fine = room.layout->texel_at(patch, 0, uv);
  const auto even = room.lit({glm::vec3(4.0f), glm::vec3(5.0f), true}).guess(patch, 0, fine);
  ASSERT_TRUE(even && even->surrounded);
  EXPECT_LT(sharp_of(*even).variance, 0.001f * 16);
  // A slope of one and three a texel, at a value of some tens: its spread is the greater part of the error.
  const auto slope = sloping(room.layout).guess(patch, 0, fine);
  ASSERT_TRUE(slope && slope->surrounded);
  const glm::vec2 part = glm::fract(room.layout->texel_at(patch, room.layout->coarse_level(), uv) - 0.5f);
  // Along an axis, positions -1, 0, 1, 2 with weights (1 - p, 1, 1, p) / 3.
  const auto around = [](float p) {
    const float mean = (-(1 - p) + 1 + 2 * p) / 3;
    return ((1 - p) + 1 + 4 * p) / 3 - mean * mean;
  };
  EXPECT_NEAR(slope->sharp_around, around(part.x) + 9 * around(part.y), 0.02f);
  EXPECT_GT(sharp_of(*slope).variance, 0.5f * slope->sharp_spread);
  // Smooth here, with a step beside: what is finer may have it.
  LightGuess beside = *even;
  beside.sharp_around = 4;
  EXPECT_GT(sharp_of(beside).variance, 4 * sharp_of(*even).variance);
}

TEST(StoredLight, TexelsWithoutSamplesStartFromItAndKeepTheirAlbedo) {
  const Room room(matte(0.5f), 128);
  const auto dir = std::filesystem::temp_directory_path() / ("darm_guess_" + std::to_string(::getpid()));
  auto store = atlas::RadianceStore::open(dir, {}, *room.layout).value();
  const auto mapper = std::make_shared<atlas::TexelMapper>(room.scene, room.layout);
  const auto surfaces =
      make_scene_surfaces(room.scene, mapper, std::make_shared<LightTransport>(room.scene, room.rays));
  const auto light = room.lit({glm::vec3(0.25f), glm::vec3(0.15f), true});
  const TileId tile(0, 0);
  TileFactsCache facts;
  facts.get(tile, *surfaces, *store)->learn_albedo(*surfaces->tile(tile), TexelMask::all());
  const auto level = level_tiles_of(*room.layout).front();
  const DisplayOptions options{1.0f, 384};
  EXPECT_FALSE(TileDisplay(*store, facts, options).draw(tile, level, TexelMask::all())) << "nothing is known";
  const auto picture = TileDisplay(*store, facts, options, &light).draw(tile, level, TexelMask::all());
  ASSERT_TRUE(picture);
  const float albedo = facts.find(tile)->albedo(5 * kTileSize + 5).x;
  EXPECT_EQ(picture->image->rgb[(6 * kSlotSize + 6) * 3], srgb_code(0.4f * albedo));
  EXPECT_EQ(picture->samples, 0.0f);
  EXPECT_GT(picture->error, 0.002f) << "it is only a guess";
  EXPECT_LT(picture->error, 0.01f) << "but light is the same all around";
  std::filesystem::remove_all(dir);
}

TEST(StoredLight, AMirrorTakesItsSoftLightAndLooksForSharpLightItself) {
  auto mirror = HandScene::matte(glm::vec3(1.0f));
  mirror.metallic = 1;
  mirror.roughness = 0;
  HandScene hand;
  hand.box(glm::vec3(-2), glm::vec3(2), hand.material(matte(0.5f)), true);
  hand.box(glm::vec3(-0.2f, -2.0f, -0.2f), glm::vec3(0.2f, -1.9f, 0.2f), hand.material(mirror), false);
  const auto scene = hand.share();
  const auto rays = trace::RayScene::build(scene, 1).value();
  const LightTransport transport(scene, rays);
  const auto layout = atlas::build_layout(*scene, {.q = 16}).value();
  StoredLight light(layout);
  const std::vector<StoredTexel> tile(kTileTexels, {glm::vec3(100.0f), glm::vec3(2.0f), true});
  for (std::uint32_t t = 0; t < layout->levels.back().tiles_x * layout->levels.back().tiles_y; ++t) light.put(t, tile);
  trace::Hit hit;
  ASSERT_TRUE(rays->closest({{0.05f, 0.0f, 0.03f}, 0.0f, {0, -1, 0}, 10.0f}, hit));  // down to the mirror's top
  const SurfacePoint point{hit.instance, hit.triangle, hit.u, hit.v, hit.front};
  for (std::uint32_t i = 0; i < 50; ++i) {
    Sampler sampler(9, 1, i);
    // It sees the far ceiling: 0.5 * (soft 2 + no sharp, for there is no lamp), not the 100 of coarse sharp light.
    EXPECT_NEAR(transport.view_dependent(point, {0.05f, 1.0f, 0.03f}, sampler, &light).radiance.x, 1.0f, 0.02f);
  }
}

TEST(StoredLight, WithoutAnyThePathGoesOn) {
  HandScene hand;
  hand.box(glm::vec3(-2), glm::vec3(2), hand.material(HandScene::matte(glm::vec3(0.5f), glm::vec3(0.5f))), true);
  const auto scene = hand.share();
  const auto rays = trace::RayScene::build(scene, 1).value();
  const LightTransport transport(scene, rays);
  const StoredLight unlit(atlas::build_layout(*scene, {.q = 16}).value());
  for (std::uint32_t i = 0; i < 50; ++i) {
    Sampler a(3, 7, i), b(3, 7, i);
    EXPECT_EQ(transport.soft_light(kFloor, a), transport.soft_light(kFloor, b, &unlit));
  }
}

// A furnace whose walls emit nothing but are known to shine like one: a glossy dielectric keeps its energy, the coat by
// paths that go on, the base from what is stored. Five standard errors: fails by chance once in 2e6.
TEST(StoredLight, WhatACoatReflectsIsNotLost) {
  auto coated = matte(0.8f);
  coated.ior = 1.5f;
  coated.roughness = 0.3f;
  const Room room(coated);
  const auto stored = room.lit(soft(1.0f));
  double mean = 0, m2 = 0;
  constexpr std::uint32_t kSamples = 200000;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    Sampler sampler(5, hash_pair(i / 64, 1), i % 64);
    const double x = room.transport->soft_light(kFloor, sampler, &stored).x;
    const double d = x - mean;
    mean += d / (i + 1);
    m2 += d * (x - mean);
  }
  const double error = std::sqrt(m2 / kSamples / kSamples);
  // Diffuse share 0.8 * (1 - F0) * 20 / 21 seen evenly from all sides; the coat sends on what it meets there: the sum
  // of the series share * (1 + c + c^2 ...) with c the coat's mean reflectance, F0 + (1 - F0) / 21, within what single
  // scattering loses at roughness 0.3 (under 1 %).
  const double f0 = 0.04, coat = f0 + (1 - f0) / 21;
  EXPECT_NEAR(mean, 0.8 * (1 - coat) / (1 - coat), 5 * error + 0.012);
}

}  // namespace
}  // namespace darm::renderer
