#include "actors/tile_scheduler/view_demand.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "actors/tile_scheduler/coarseness.hpp"
#include "actors/tile_scheduler/image_store.hpp"
#include "actors/tile_scheduler/visibility.hpp"
#include "actors/tile_scheduler/working_set.hpp"
#include "tests/unit/tile_scheduler/quad_scene.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr Viewport kViewport{160, 90};

class Demand : public ::testing::Test {
 protected:
  Demand() : world_(testing::make_room()) {
    const ViewSampler sampler(*world_.layout, *world_.rays, look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55), kViewport);
    for (int pass = 0; pass < kAllPasses; ++pass) {
      VisibleSet one;
      trace_rows(sampler, pass, 0, block_rows(kViewport), one);
      set_.add(one, 1);
    }
  }
  [[nodiscard]] ViewDemand demand(std::size_t slots, const CoarseLuma* coarse = nullptr) const {
    const auto images = [this](TileId t) { return find(t); };
    return demand_of(set_.seen(), *world_.layout, PageTable(slots), images, coarse, {});
  }
  [[nodiscard]] const StoredImage* find(TileId tile) const {
    const auto it = images_.find(tile);
    return it == images_.end() ? nullptr : &it->second;
  }
  void shade(TileId tile, float error) {
    images_[tile].error = error;
    images_[tile].image = std::make_shared<TileImage>();
  }

  testing::TestWorld world_;
  WorkingSet set_;
  std::map<TileId, StoredImage> images_;
};

TEST_F(Demand, AsksForEveryTargetTileAndForNeighboursOnlyAsBorders) {
  for (const std::size_t slots : {4096u, 30u}) {
    const auto d = demand(slots);
    const std::set<TileId> target(d.target.tiles.begin(), d.target.tiles.end());
    std::set<TileId> displayed;
    for (const auto& request : d.requests) {
      EXPECT_FALSE(request.mask.empty());
      EXPECT_GT(request.weight, 0);
      if (request.display) {
        displayed.insert(request.tile);
      } else {
        EXPECT_FALSE(target.contains(request.tile));
        EXPECT_EQ(request.mask, set_.current().find(request.tile)->border);
      }
    }
    EXPECT_EQ(displayed, target);
  }
}

TEST_F(Demand, DoesNotShadeFallbackTexelsOfATileThatServesOnlyItsOwnLevel) {
  const auto d = demand(4096);
  for (const auto& request : d.requests) {
    if (!request.display) continue;
    const auto* use = set_.current().find(request.tile);
    auto expected = use->sharp;
    expected |= use->border;
    EXPECT_EQ(request.mask, expected);
  }
}

TEST_F(Demand, CoarseTexelsUnderTheViewAreAskedForUntilThereIsACoarsePicture) {
  const auto d = demand(4096);
  std::set<std::uint32_t> tiles;
  for (const auto& request : d.coarse) {
    EXPECT_TRUE(tiles.insert(request.tile).second) << "one request a tile";
    EXPECT_FALSE(request.mask.empty());
  }
  // Every tile of the coarse level that some chain could be served by is among them.
  const int coarse = world_.layout->coarse_level();
  for (const auto& tile : set_.current().tiles())
    if (tile.level() == coarse && !set_.current().find(tile)->fallback.empty()) {
      EXPECT_TRUE(tiles.contains(tile.index())) << tile.index();
    }
  const CoarseLuma luma{2, 2, std::vector<std::uint8_t>(4)};
  EXPECT_TRUE(demand(64, &luma).coarse.empty());
}

TEST_F(Demand, GrantsOnlyTilesWithPicturesAndEndsAtTheTarget) {
  auto d = demand(4096);
  EXPECT_TRUE(d.granted.tiles.empty());
  const auto error = [&](bool has_coarse) {
    return view_error(
        d.chains, d.granted.served, [this](TileId t) { return find(t); }, world_.layout->coarse_level(), has_coarse);
  };
  EXPECT_FLOAT_EQ(error(false), ErrorOptions{}.unlit);
  EXPECT_LE(error(true), std::hypot(error_of_coarser(16), ErrorOptions{}.coarse_tex));
  for (std::size_t i = 0; i < d.target.tiles.size(); i += 2) shade(d.target.tiles[i], 0.1f);
  const auto lookup = [this](TileId t) { return find(t); };
  grant_available(d, world_.layout->coarse_level(), PageTable(4096), lookup, {});
  EXPECT_FALSE(d.granted.tiles.empty());
  for (const auto tile : d.granted.tiles) EXPECT_NE(find(tile), nullptr);
  EXPECT_GT(error(false), 0.1f);
  EXPECT_LT(error(false), ErrorOptions{}.unlit);
  EXPECT_LT(error(true), error(false));
  for (const auto tile : d.target.tiles) shade(tile, 0.1f);
  grant_available(d, world_.layout->coarse_level(), PageTable(4096), lookup, {});
  EXPECT_EQ(d.granted.tiles, d.target.tiles);
  EXPECT_NEAR(error(true), 0.1f, 1e-5);
}

// A small scene's sharp level may be the coarse level itself: nothing is too coarse then, and yet it is no tile.
TEST(ViewError, OfCoarseTexIsNeverNothing) {
  Chain chain;
  chain.tiles[0] = TileId(2, 0);
  const std::vector<WeightedChain> chains{{chain, 1.0f}};
  const std::vector<std::uint8_t> served{kServedByCoarse};
  const auto none = [](TileId) -> const StoredImage* { return nullptr; };
  EXPECT_FLOAT_EQ(view_error(chains, served, none, 2, true), ErrorOptions{}.coarse_tex);
}

TEST(JoinRequests, AddsWeightsAndJoinsMasks) {
  renderer::TileRequest a, b;
  a.tile = b.tile = TileId(1, 5);
  a.weight = 0.25f;
  b.weight = 0.5f;
  a.display = false;
  a.mask.set(1, 2);
  b.mask.set(3, 4);
  const std::vector<renderer::TileRequest> one{a}, two{b};
  const auto joined = join_requests({&one, &two});
  ASSERT_EQ(joined.size(), 1u);
  EXPECT_FLOAT_EQ(joined[0].weight, 0.75f);
  EXPECT_TRUE(joined[0].display);
  EXPECT_EQ(joined[0].mask.count(), 2);
}

ShadedTile shaded(std::uint32_t index, std::uint32_t version) {
  ShadedTile tile;
  tile.tile = TileId(0, index);
  tile.version = version;
  tile.image = std::make_shared<TileImage>();
  return tile;
}

TEST(ImageStore, KeepsTheNewestVersionAndTheLatestWantedTiles) {
  ImageStore store(3 * sizeof(TileImage));
  EXPECT_TRUE(store.put(shaded(1, 5)));
  EXPECT_FALSE(store.put(shaded(1, 4)));
  EXPECT_EQ(store.find(TileId(0, 1))->version, 5u);
  EXPECT_TRUE(store.put(shaded(2, 1)));
  EXPECT_TRUE(store.put(shaded(3, 1)));
  store.touch(TileId(0, 1));
  EXPECT_TRUE(store.put(shaded(4, 1)));
  EXPECT_EQ(store.size(), 3u);
  EXPECT_EQ(store.find(TileId(0, 2)), nullptr);
  EXPECT_NE(store.find(TileId(0, 1)), nullptr);
}

}  // namespace
}  // namespace darm::tile_scheduler
