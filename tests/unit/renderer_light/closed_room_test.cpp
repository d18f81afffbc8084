// What no light reaches stays dark: at the edges where walls meet, and beside walls that stand in a texel.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <memory>

#include "actors/atlas/build_layout.hpp"
#include "actors/renderer/divided_texels.hpp"
#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/tile_surface_scene.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::renderer {
namespace {

using test::HandScene;

// A scene under a bright sky, with the surfaces of its tiles.
struct Lit {
  explicit Lit(HandScene& hand, float q) {
    hand.scene.sky = {glm::vec3(1000), glm::vec3(1000), glm::vec3(1000)};
    scene = hand.share();
    layout = atlas::build_layout(*scene, {.q = q}).value();
    rays = trace::RayScene::build(scene, 1).value();
    mapper = std::make_shared<atlas::TexelMapper>(scene, layout);
    surfaces = make_scene_surfaces(scene, mapper, std::make_shared<LightTransport>(scene, rays), 5);
  }
  /// Calls f(tile, its surface) for every tile of a level.
  template <class F>
  void each_tile(int level, F&& f) const {
    const auto& l = layout->levels[static_cast<std::size_t>(level)];
    for (std::uint32_t t = 0; t < l.tiles_x * l.tiles_y; ++t) f(t, *surfaces->tile(TileId(level, t)));
  }

  std::shared_ptr<const scene::Scene> scene;
  std::shared_ptr<const atlas::Layout> layout;
  std::shared_ptr<const trace::RayScene> rays;
  std::shared_ptr<const atlas::TexelMapper> mapper;
  std::shared_ptr<TileSurfaces> surfaces;
};

// One skin, seen from both sides: its edges are where a ray that begins a hair too far out finds the sky.
TEST(ClosedRoom, no_sample_of_its_inside_finds_the_sky) {
  for (const float scale : {1.0f, 100.0f}) {
    for (const glm::vec3 place : {glm::vec3(0), glm::vec3(300, -70, 20)}) {
      HandScene hand;
      hand.box(place - scale, place + scale, hand.material(HandScene::matte(glm::vec3(0.8f))), true);
      const Lit room(hand, 16 / scale);
      int samples = 0;
      room.each_tile(0, [&](std::uint32_t tile, const TileSurface& surface) {
        for (int texel = 0; texel < kTileTexels; ++texel)
          for (std::uint32_t i = 0; i < 4; ++i) {
            const auto soft = surface.soft(texel, i);
            if (!soft) continue;
            ++samples;
            ASSERT_EQ(*soft, glm::vec3(0.0f)) << "tile " << tile << " texel " << texel << " scale " << scale;
          }
      });
      EXPECT_GT(samples, 10'000);
    }
  }
}

constexpr float kWall = 0.1f;

// A floor in one piece, 4 m a side, and a wall 1 cm thick across it at x = kWall.
HandScene parted_floor() {
  HandScene hand;
  const auto matte = hand.material(HandScene::matte(glm::vec3(0.5f)));
  hand.quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, matte);
  hand.box({kWall - 0.005f, 0, -2}, {kWall + 0.005f, 1, 2}, matte, false);
  return hand;
}

TEST(DividedTexels, are_those_that_a_wall_stands_in) {
  auto hand = parted_floor();
  const Lit floor(hand, 8);
  const float half = 0.5f / floor.layout->levels[0].density;
  std::array<int, 2> counts{};
  floor.each_tile(0, [&](std::uint32_t tile, const TileSurface& surface) {
    const auto texels = floor.mapper->tile(TileId(0, tile));
    for (int t = 0; t < kTileTexels; ++t) {
      const auto middle = texels->center(t % kTileSize, t / kTileSize);
      if (!middle || middle->instance != 0 || texels->is_gutter(t % kTileSize, t / kTileSize)) continue;
      const float away = std::abs(trace::make_unbent_surface(*floor.rays, *middle).position.x - kWall);
      if (away > 0.3f * half && away < 0.7f * half) {  // the wall is between the middle and a side
        EXPECT_TRUE(surface.divided(t)) << "texel " << t << ", " << away << " m away";
        ++counts[0];
      } else if (away > 1.2f * half) {
        EXPECT_FALSE(surface.divided(t)) << "texel " << t << ", " << away << " m away";
        ++counts[1];
      }
    }
  });
  EXPECT_GT(counts[0], 10);
  EXPECT_GT(counts[1], 500);
}

TEST(DividedTexels, are_unknown_to_paths_and_the_others_keep_their_light) {
  auto hand = parted_floor();
  const Lit floor(hand, 8);
  const auto tiles = floor.layout->levels[0].tiles_x * floor.layout->levels[0].tiles_y;
  DividedTexels divided(0, tiles);
  for (int round = 0; round < 2; ++round)  // the second from memory
    floor.each_tile(0, [&](std::uint32_t tile, const TileSurface& surface) {
      std::array<StoredTexel, kTileTexels> texels;
      texels.fill({glm::vec3(1), glm::vec3(2), true});
      texels[7].known = false;
      divided.forget(tile, texels, *floor.surfaces);
      for (int t = 0; t < kTileTexels; ++t)
        ASSERT_EQ(texels[static_cast<std::size_t>(t)].known, t != 7 && !surface.divided(t)) << tile << " " << t;
    });
  std::array<StoredTexel, 3> few;
  divided.forget(0, few, *floor.surfaces);  // wrong sizes and tiles are left alone
  std::array<StoredTexel, kTileTexels> none;
  divided.forget(tiles, none, *floor.surfaces);
}

TEST(DividedTexels, a_curved_surface_is_no_wall_to_itself) {
  constexpr int kFacets = 64;
  HandScene hand;
  scene::Mesh column;
  for (int i = 0; i <= kFacets; ++i)
    for (const float y : {0.0f, 3.0f}) {
      const float angle = 2 * glm::pi<float>() * static_cast<float>(i) / kFacets;
      const glm::vec3 n(std::cos(angle), 0, std::sin(angle));
      column.positions.push_back(0.3f * n + glm::vec3(0, y, 0));
      column.normals.push_back(n);
      column.uvs[0].emplace_back(static_cast<float>(i) / kFacets, y / 3);
    }
  for (std::uint32_t i = 0; i < kFacets; ++i) {
    const std::uint32_t a = 2 * i;
    column.triangles.emplace_back(a, a + 1, a + 3);
    column.triangles.emplace_back(a, a + 3, a + 2);
  }
  column.material = hand.material(HandScene::matte(glm::vec3(0.5f)));
  hand.place(column);
  const Lit lit(hand, 8);
  int looked = 0;
  lit.each_tile(0, [&](std::uint32_t, const TileSurface& surface) {
    for (int t = 0; t < kTileTexels; ++t) {
      if (surface.patch(t) == kNobody) continue;
      EXPECT_FALSE(surface.divided(t)) << t;
      ++looked;
    }
  });
  EXPECT_GT(looked, 200);
}

}  // namespace
}  // namespace darm::renderer
