// What an eye sees that depends on it, and which private tiles that makes.
#include "actors/tile_scheduler/private_layer.hpp"

#include <gtest/gtest.h>

#include "actors/tile_scheduler/visibility.hpp"
#include "tests/unit/tile_scheduler/quad_scene.hpp"

namespace darm::tile_scheduler {
namespace {

class PrivateLayerTest : public ::testing::Test {
 protected:
  static constexpr Viewport kPicture{160, 90};

  // One pass over the room, with these materials.
  PrivateSet see(const std::vector<scene::ViewMaterial>& materials, VisibleSet* shared = nullptr) {
    const ViewSampler sampler(*world.layout, *world.rays, camera, kPicture);
    VisibleSet all;
    PrivateSet own;
    for (int pass = 0; pass < 4; ++pass) trace_rows(sampler, pass, 0, block_rows(kPicture), all, {materials, &own});
    if (shared != nullptr) *shared = all;
    return own;
  }
  [[nodiscard]] std::vector<scene::ViewMaterial> all_of(float weight, std::uint8_t coarser) const {
    return std::vector<scene::ViewMaterial>(world.scene->instances.size(), {weight, weight, coarser});
  }
  [[nodiscard]] PrivateLayer layer_of(std::uint32_t phystex) const {
    StreamFormat format;
    format.phystex_size = phystex;
    return {format, {}, {}};
  }

  testing::TestWorld world = testing::make_room();
  Camera camera = look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55);
};

TEST_F(PrivateLayerTest, only_surfaces_with_weight_are_gathered) {
  EXPECT_TRUE(see(all_of(0, 0)).empty());
  auto one = all_of(0, 0);
  one[0].weight = 0.5f;
  const auto some = see(one);
  EXPECT_FALSE(some.empty());
  EXPECT_LT(some.chains().size(), see(all_of(0.5f, 0)).chains().size());
}

TEST_F(PrivateLayerTest, a_mirror_uses_the_tiles_of_the_shared_layer_and_marks_the_texels_it_reads) {
  VisibleSet shared;
  const auto own = see(all_of(1, 0), &shared);
  for (const auto& chain : own.chains()) {
    const auto* use = shared.find(chain.tiles[0]);
    ASSERT_NE(use, nullptr);
    const auto* mask = own.find(chain.tiles[0]);
    ASSERT_NE(mask, nullptr);
    for (int t = 0; t < kTileTexels; ++t) {
      const int at = (t / kTileSize + 1) * kSlotSize + t % kTileSize + 1;
      EXPECT_TRUE(!use->sharp.test(t) || mask->test(at));
    }
  }
}

TEST_F(PrivateLayerTest, rough_surfaces_begin_at_a_coarser_level_that_the_client_still_reaches) {
  const auto sharp = see(all_of(1, 0));
  const auto rough = see(all_of(1, 3));
  EXPECT_LT(rough.chains().size(), sharp.chains().size());
  for (const auto& chain : rough.chains()) {
    EXPECT_NE(chain.tiles[0], kNoTile);
    EXPECT_EQ(chain.tiles[3], kNoTile);
  }
}

TEST_F(PrivateLayerTest, requests_fit_the_slots_and_serve_the_whole_view) {
  float whole = 0;
  for (const std::uint32_t size : {512u, 64u}) {
    auto layer = layer_of(size);
    layer.add(see(all_of(0.5f, 0)));
    layer.reallocate({}, world.layout->coarse_level());
    const auto slots = std::size_t{size / 32} * (size / 32);
    ASSERT_FALSE(layer.requests()->empty());
    EXPECT_LE(layer.requests()->size(), slots);
    float share = 0;
    for (const auto& r : *layer.requests()) {
      share += r.share;
      EXPECT_GT(r.mask.count(), 0);
    }
    whole = std::max(whole, share);
    EXPECT_GT(share, 0.5f) << "the rest is sky";
    EXPECT_GT(share, 0.75f * whole) << "coarser tiles when slots run short";
  }
}

TEST_F(PrivateLayerTest, sends_what_has_come_and_forgets_the_pose_before_in_time) {
  auto layer = layer_of(512);
  EXPECT_TRUE(layer.idle());
  layer.start_pose(0);
  layer.add(see(all_of(0.5f, 0)));
  layer.reallocate({}, world.layout->coarse_level());
  EXPECT_TRUE(layer.idle()) << "no pictures yet";
  ShadedTile tile;
  tile.tile = layer.requests()->front().tile;
  tile.version = 1;
  tile.image = std::make_shared<TileImage>();
  layer.put({tile});
  EXPECT_FALSE(layer.idle());
  const auto step = layer.step(1000);
  ASSERT_TRUE(step.frame);
  EXPECT_EQ(step.frame->writes.size(), 1u);
  const auto before = layer.requests()->size();
  camera = look_at({0.3, 0.4, 1.5}, {-4, 0, -2}, 55);
  layer.start_pose(10'000);
  layer.add(see(all_of(0.5f, 0)));
  layer.reallocate({}, world.layout->coarse_level());
  const auto both = layer.requests()->size();
  EXPECT_FALSE(layer.expire(20'000));
  EXPECT_TRUE(layer.expire(600'000));
  layer.reallocate({}, world.layout->coarse_level());
  EXPECT_LT(layer.requests()->size(), both);
  EXPECT_GT(before, 0u);
}

TEST_F(PrivateLayerTest, the_error_left_is_what_is_missing_then_what_the_pictures_have) {
  auto materials = all_of(0.5f, 0);
  for (auto& m : materials) m.omitted.fill(0.09f);
  VisibleSet shared;
  auto layer = layer_of(512);
  EXPECT_EQ(layer.squared_error(1), 0.0);
  layer.add(see(materials, &shared));
  layer.reallocate({}, world.layout->coarse_level());
  const double surfaces = shared.surface_samples() / shared.samples();
  EXPECT_NEAR(layer.squared_error(1), 0.09 * surfaces, 1e-4) << "nothing has come";
  EXPECT_NEAR(layer.squared_error(0.5f), 0.0225 * surfaces, 1e-4);
  EXPECT_NEAR(shared.omitted_error(), 0.3f, 1e-5f) << "what a session without a layer lacks";
  std::vector<ShadedTile> tiles;
  for (const auto& request : *layer.requests()) {
    auto& tile = tiles.emplace_back();
    tile.tile = request.tile;
    tile.version = 1;
    tile.error = 0.02f;
    tile.image = std::make_shared<TileImage>();
  }
  layer.put(tiles);
  layer.reallocate({}, world.layout->coarse_level());
  EXPECT_NEAR(layer.squared_error(1), 0.0004 * surfaces, 1e-5) << "all slots suffice";
}

}  // namespace
}  // namespace darm::tile_scheduler
