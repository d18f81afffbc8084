#include "actors/renderer/coarse_coverage.hpp"

#include <gtest/gtest.h>

#include "tests/unit/renderer_tile/made_up_surface.hpp"

namespace darm::renderer {
namespace {

scene::Scene scene_of(scene::AlphaMode mode) {
  scene::Scene scene;
  scene.materials.emplace_back().alpha_mode = mode;
  return scene;
}

TEST(CoarseCoverage, is_the_alpha_of_each_texel_row_by_row_across_tiles) {
  MadeUpWorld surfaces;
  surfaces.world.translucent = true;
  surfaces.world.alpha = [](TileId tile, int x, int y) { return tile.index() == 4 && x == 3 && y == 29 ? 0.2f : 1.0f; };
  const LevelTiles tiles{3, 2};
  for (const unsigned threads : {1u, 4u}) {
    const auto out = coarse_coverage(scene_of(scene::AlphaMode::kMask), 2, tiles, surfaces, threads);
    ASSERT_EQ(out.size(), std::size_t{90} * 60);
    for (std::size_t i = 0; i < out.size(); ++i) ASSERT_EQ(out[i], i == 59 * 90 + 33 ? 51 : 255) << i;
  }
}

TEST(CoarseCoverage, is_empty_where_all_is_opaque) {
  MadeUpWorld surfaces;
  surfaces.world.translucent = true;
  EXPECT_TRUE(coarse_coverage(scene_of(scene::AlphaMode::kBlend), 0, {2, 2}, surfaces, 1).empty());
  surfaces.world.alpha = [](TileId, int, int) { return 0.0f; };
  EXPECT_TRUE(coarse_coverage(scene_of(scene::AlphaMode::kOpaque), 0, {2, 2}, surfaces, 1).empty())
      << "no material asks for it";
}

}  // namespace
}  // namespace darm::renderer
