#include "actors/tile_scheduler/stream_demand.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "actors/tile_scheduler/wanted_tiles.hpp"
#include "tests/unit/tile_scheduler/random.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr int kCoarse = 6;

// A picture of `count` samples on a flat surface around (x, y), each tile at a level of its own.
ViewDemand view_at(std::uint32_t x, std::uint32_t y, std::uint32_t side, std::uint32_t seed) {
  testing::Random random(seed);
  ViewDemand view;
  double all = 0;
  for (std::uint32_t i = 0; i < side; ++i)
    for (std::uint32_t j = 0; j < side; ++j) {
      Chain chain;
      for (int level = 0; level < kChainLength; ++level)
        chain.tiles[static_cast<std::size_t>(level)] = TileId(level, ((y + i) >> level) * 4096 + ((x + j) >> level));
      view.chains.push_back({chain, std::exp(-static_cast<float>(random() % 300) / 100.0f)});
      all += double(view.chains.back().weight);
    }
  for (auto& chain : view.chains) chain.weight /= static_cast<float>(all);
  return view;
}

class SharedSlots : public ::testing::Test {
 protected:
  void share(std::vector<ViewDemand>& views, std::size_t slots) {
    std::vector<ViewDemand*> all;
    std::vector<const ViewDemand*> seen;
    for (auto& view : views) {
      all.push_back(&view);
      seen.push_back(&view);
    }
    joint_ = join_views(seen);
    share_slots(all, joint_, PageTable(slots), lookup(), kCoarse, {});
  }
  ImageLookup lookup() {
    return [this](TileId tile) -> const StoredImage* {
      const auto it = images_.find(tile);
      return it == images_.end() ? nullptr : &it->second;
    };
  }
  void shade(TileId tile) { images_[tile].image = std::make_shared<TileImage>(); }
  // Levels coarser than sharp, on average over the picture.
  static double bias(const ViewDemand& view) {
    double sum = 0;
    for (std::size_t c = 0; c < view.chains.size(); ++c) sum += double(view.chains[c].weight) * view.target.served[c];
    return sum;
  }
  JointView joint_;
  std::map<TileId, StoredImage> images_;
};

TEST_F(SharedSlots, AViewAmongOthersIsServedByTilesThatAreThere) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    testing::Random random(seed);
    std::vector<ViewDemand> views;
    for (std::uint32_t i = 0; i < 2 + random() % 5; ++i)
      views.push_back(view_at(random() % 40, random() % 40, 4 + random() % 16, random()));
    const std::size_t slots = 30 + random() % 200;
    share(views, slots);
    std::set<TileId> targets;
    for (const auto& view : views) targets.insert(view.target.tiles.begin(), view.target.tiles.end());
    EXPECT_LE(targets.size(), slots);
    for (const auto& view : views) {
      ASSERT_EQ(view.target.served.size(), view.chains.size());
      for (std::size_t c = 0; c < view.chains.size(); ++c) {
        const auto& chain = view.chains[c].chain;
        int finest = 0;
        while (finest < kChainLength && !targets.contains(chain.tiles[static_cast<std::size_t>(finest)])) ++finest;
        EXPECT_EQ(view.target.served[c], finest) << "also by what is there for others";
      }
    }
    for (const auto& view : views) EXPECT_TRUE(view.granted.tiles.empty()) << "there are no pictures";
  }
}

TEST_F(SharedSlots, LevelsCoarsenEvenlyOverViewsAlike) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    std::vector<ViewDemand> views;
    for (std::uint32_t i = 0; i < 5; ++i) views.push_back(view_at(64 * i, 128, 16, seed));
    share(views, 400);  // of 1280
    double least = 10, most = 0;
    for (const auto& view : views) {
      least = std::min(least, bias(view));
      most = std::max(most, bias(view));
    }
    EXPECT_GT(least, 0.1);
    EXPECT_LT(most - least, 0.25) << "levels";
  }
}

TEST_F(SharedSlots, AHugeViewDoesNotStarveASmallOne) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    std::vector<ViewDemand> views{view_at(0, 0, 40, seed), view_at(200, 200, 6, seed + 100)};
    share(views, 256);
    EXPECT_LE(bias(views[1]), bias(views[0]) + 0.05);
    EXPECT_LT(bias(views[1]), 0.6);
  }
}

TEST_F(SharedSlots, WhatOneSeesAloneCountsForAsMuchAsItIsOfThatPicture) {
  auto a = view_at(0, 0, 8, 1), b = view_at(4, 0, 8, 2);
  const std::vector<const ViewDemand*> both{&a, &b};
  const auto joint = join_views(both);
  double weight = 0;
  for (const auto& chain : joint.chains) weight += double(chain.weight);
  EXPECT_NEAR(weight, 2.0, 1e-4);
  EXPECT_EQ(joint.chains.size(), 96u) << "half of each is seen by both";
  for (std::size_t c = 0; c < a.chains.size(); ++c)
    EXPECT_EQ(joint.chains[joint.number[0][c]].chain, a.chains[c].chain);
  EXPECT_TRUE(joint.losses.empty());
}

TEST_F(SharedSlots, MeasuredLossesAreMeansByWeightAndStandInForThoseNotMeasured) {
  auto a = view_at(0, 0, 1, 1), b = a, other = view_at(50, 50, 1, 1);
  b.chains[0].weight = 3;
  a.losses = {{0, 1, 2, 3, 4}};
  b.losses = {{0, 5, 6, 7, 8}};
  const std::vector<const ViewDemand*> all{&a, &b, &other};
  const auto joint = join_views(all);
  ASSERT_EQ(joint.losses.size(), 2u);
  EXPECT_FLOAT_EQ(joint.losses[0][1], 4);
  EXPECT_FLOAT_EQ(joint.losses[0][4], 7);
  EXPECT_FLOAT_EQ(joint.losses[1][4], 7);
}

TEST_F(SharedSlots, GrantedAreTilesWithPictures) {
  std::vector<ViewDemand> views{view_at(0, 0, 16, 1), view_at(8, 0, 16, 2)};
  share(views, 150);
  for (std::size_t i = 0; i < views[0].target.tiles.size(); i += 2) shade(views[0].target.tiles[i]);
  std::vector<ViewDemand*> all{&views[0], &views[1]};
  share_available(all, joint_, PageTable(150), lookup(), kCoarse, {});
  for (const auto& view : views) {
    EXPECT_FALSE(view.granted.tiles.empty());
    for (const auto tile : view.granted.tiles) EXPECT_TRUE(images_.contains(tile));
    EXPECT_LT(view.lit, 1);
  }
  for (const auto& view : views)
    for (const auto tile : view.target.tiles) shade(tile);
  share_available(all, joint_, PageTable(150), lookup(), kCoarse, {});
  EXPECT_EQ(views[1].granted.tiles, views[1].target.tiles);
}

TEST(WantedTiles, AreThoseFirstThatShowMostOfAllViews) {
  testing::Random random(8);
  WantedTiles wanted;
  std::vector<Allocation> views;
  for (int step = 0; step < 300; ++step) {
    if (views.size() < 8 || random() % 2 == 0) {
      auto& view = views.emplace_back();
      const auto first = random() % 20'000;
      for (std::uint32_t i = 0; i < random() % 600; ++i) {
        view.tiles.emplace_back(0, first + 3 * i);
        view.weights.push_back(static_cast<float>(1 + random() % 1000) / 1024.0f);  // sums are exact
      }
      wanted.add(view);
    } else {
      const auto i = random() % views.size();
      wanted.remove(views[i]);
      views.erase(views.begin() + static_cast<std::ptrdiff_t>(i));
    }
    std::map<TileId, float> weight;
    for (const auto& view : views)
      for (std::size_t i = 0; i < view.tiles.size(); ++i) weight[view.tiles[i]] += view.weights[i];
    std::vector<TileId> expected;
    for (const auto& [tile, w] : weight) expected.push_back(tile);
    std::ranges::stable_sort(expected, [&](TileId a, TileId b) { return weight[a] > weight[b]; });
    if (expected.size() > 1000) expected.resize(1000);
    ASSERT_EQ(wanted.list(1000), expected);
  }
}

TEST(SignificantTiles, AreTheFewThatShowMostOfAView) {
  auto view = view_at(0, 0, 10, 5);
  view.chains[37].weight = 10;
  EXPECT_EQ(significant_tiles(view.chains, 0.9), std::vector<TileId>{view.chains[37].chain.tiles[0]});
  EXPECT_EQ(significant_tiles(view.chains, 1.0).size(), 100u);
  EXPECT_EQ(sharp_tiles(view.chains).size(), 100u);
  EXPECT_TRUE(significant_tiles({}, 0.9).empty());
}

}  // namespace
}  // namespace darm::tile_scheduler
