// What no light reaches stays dark: at the edges where walls meet, and beside walls that stand in a texel.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "actors/renderer/divided_texels.hpp"
#include "tests/unit/renderer_light/hand_tiles.hpp"

namespace darm::renderer {
namespace {

using test::HandScene;

// One skin, seen from both sides: its edges are where a ray that begins a hair too far out finds the sky.
TEST(ClosedRoom, no_sample_of_its_inside_finds_the_sky) {
  for (const float scale : {1.0f, 100.0f}) {
    for (const glm::vec3 place : {glm::vec3(0), glm::vec3(300, -70, 20)}) {
      HandScene hand;
      hand.box(place - scale, place + scale, hand.material(HandScene::matte(glm::vec3(0.8f))), true);
      const HandTiles room(hand, 16 / scale);
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

TEST(DividedTexels, are_those_that_a_wall_stands_in) {
  auto hand = parted_floor(kWall);
  const HandTiles floor(hand, 8);
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
  auto hand = parted_floor(kWall);
  const HandTiles floor(hand, 8);
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
  auto hand = round_column();
  const HandTiles lit(hand, 8);
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
