#include "actors/tile_scheduler/chain_loss.hpp"

#include <gtest/gtest.h>

#include <map>

#include "actors/tile_scheduler/slot_allocation.hpp"

namespace darm::tile_scheduler {
namespace {

// Views made by hand: chain number n has the tiles TileId(level, n) at levels 0..3 under a coarse level 5.
constexpr int kCoarseLevel = 5;

WeightedChain chain_of(std::uint32_t number, float weight = 0.5f) {
  WeightedChain c;
  for (int i = 0; i < kChainLength; ++i) c.chain.tiles[static_cast<std::size_t>(i)] = TileId(i, number);
  c.weight = weight;
  return c;
}

SampleTaps taps_at(std::uint32_t chain, float x, float y) {
  SampleTaps t;
  t.chain = chain;
  for (std::size_t i = 0; i < kChainLength; ++i) t.set(i, {x, y});
  t.coarse = {16, 16};
  return t;
}

// 16 x 16 samples over the payload.
std::vector<SampleTaps> grid(std::uint32_t chain) {
  std::vector<SampleTaps> out;
  for (int i = 0; i < 256; ++i)
    out.push_back(taps_at(chain, 2.0f + static_cast<float>(i % 16) * 1.75f, 2.0f + static_cast<float>(i / 16) * 1.75f));
  return out;
}

class ChainLossTest : public ::testing::Test {
 protected:
  void paint(TileId tile, auto&& luma) {
    auto image = std::make_shared<TileImage>();
    for (int i = 0; i < kSlotTexels; ++i)
      image->y[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(luma(i % kSlotSize, i / kSlotSize));
    images_[tile].image = std::move(image);
  }
  void paint_flat(TileId tile, int luma) {
    paint(tile, [luma](int, int) { return luma; });
  }
  [[nodiscard]] std::vector<ChainLoss> measure(const std::vector<WeightedChain>& chains,
                                               const std::vector<SampleTaps>& taps,
                                               const CoarseLuma* coarse = nullptr) const {
    const auto find = [this](TileId t) -> const StoredImage* {
      const auto it = images_.find(t);
      return it == images_.end() ? nullptr : &it->second;
    };
    return measure_losses(chains, taps, find, coarse, kCoarseLevel);
  }
  std::map<TileId, StoredImage> images_;
};

TEST_F(ChainLossTest, IsTheSquaredDifferenceToTheSharpPicture) {
  for (int level = 0; level < 4; ++level) paint_flat(TileId(level, 0), 100 + 3 * level);
  CoarseLuma coarse{4, 4, std::vector<std::uint8_t>(16, 120)};
  const auto loss = measure({chain_of(0)}, grid(0), &coarse);
  ASSERT_EQ(loss.size(), 1u);
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(loss[0][static_cast<std::size_t>(i)], 9.0f * static_cast<float>(i * i), 1e-3f);
  EXPECT_NEAR(loss[0][kServedByCoarse], 400 + LossOptions{}.coarse_error, 1e-3f);
}

TEST_F(ChainLossTest, WithoutPicturesThereIsNone) { EXPECT_TRUE(measure({chain_of(0)}, grid(0)).empty()); }

TEST_F(ChainLossTest, CoarserLevelsWithoutPictureAreJudgedByHalvingTheFinest) {
  paint(TileId(0, 0), [](int x, int y) { return (x / 2 + y / 2) % 2 == 0 ? 80 : 120; });  // squares of two texels
  paint_flat(TileId(0, 1), 90);
  auto taps = grid(0);
  for (const auto& t : grid(1)) taps.push_back(t);
  const auto loss = measure({chain_of(0), chain_of(1)}, taps);
  EXPECT_GT(loss[0][2], 100);            // gone after two halvings: up to 20 levels off
  EXPECT_LT(loss[0][1], loss[0][2]);     // one leaves the squares
  EXPECT_NEAR(loss[1][3], 0.0f, 1e-3f);  // nothing there to lose
}

TEST_F(ChainLossTest, FinerLevelsWithoutPictureLoseAShareOfTheOctaveBeside) {
  paint_flat(TileId(1, 0), 100);
  paint_flat(TileId(2, 0), 110);
  paint_flat(TileId(3, 0), 110);
  const auto loss = measure({chain_of(0)}, grid(0));
  EXPECT_NEAR(loss[0][0], 0.0f, 1e-3f);
  EXPECT_NEAR(loss[0][1], 0.8f * 100, 1e-2f);
  EXPECT_NEAR(loss[0][2], 1.8f * 100, 1e-2f);
}

TEST_F(ChainLossTest, RisesWithThePosition) {
  paint_flat(TileId(0, 0), 100);
  paint_flat(TileId(1, 0), 130);
  paint_flat(TileId(2, 0), 101);  // by chance like the sharp one
  const auto loss = measure({chain_of(0)}, grid(0));
  for (std::size_t i = 1; i <= kChainLength; ++i) EXPECT_GE(loss[0][i], loss[0][i - 1]);
}

TEST_F(ChainLossTest, AChainThatNoTapSawTakesTheMeanOfItsTile) {
  for (int level = 0; level < 4; ++level) paint_flat(TileId(level, 0), 100 + 10 * level);
  auto unseen = chain_of(0);
  unseen.chain.tiles[3] = TileId(3, 9);
  const auto loss = measure({chain_of(0), unseen}, grid(0));
  EXPECT_NEAR(loss[1][1], loss[0][1], 1e-3f);
  EXPECT_NEAR(loss[1][2], loss[0][2], 1e-3f);
}

TEST_F(ChainLossTest, ForeignChainNumbersAreIgnored) {
  paint_flat(TileId(0, 0), 100);
  auto taps = grid(0);
  taps.push_back(taps_at(7, 5, 5));
  EXPECT_EQ(measure({chain_of(0)}, taps).size(), 1u);
}

TEST_F(ChainLossTest, TheOnlySlotGoesWhereACoarserLevelWouldShow) {
  paint_flat(TileId(0, 0), 100);
  paint(TileId(0, 1), [](int x, int) { return x % 2 == 0 ? 60 : 140; });
  auto taps = grid(0);
  for (const auto& t : grid(1)) taps.push_back(t);
  const std::vector<WeightedChain> chains{chain_of(0, 0.9f), chain_of(1, 0.1f)};
  AllocationRequest request;
  request.chains = chains;
  request.slots = 1;
  request.coarse_level = kCoarseLevel;
  request.available = [](TileId t) { return t.level() == 0; };
  ASSERT_EQ(allocate_slots(request).tiles, std::vector<TileId>{TileId(0, 0)});
  const auto losses = measure(chains, taps);
  request.losses = losses;
  EXPECT_EQ(allocate_slots(request).tiles, std::vector<TileId>{TileId(0, 1)});
}

TEST(SampleTapsTest, KeepPositionsToASixteenthOfATexel) {
  SampleTaps t;
  for (float x = 0.5f; x < 31.5f; x += 0.01f) {
    t.set(2, {x, 32 - x});
    ASSERT_NEAR(t.position(2).x, x, 0.0626f);
    ASSERT_NEAR(t.position(2).y, 32 - x, 0.0626f);
  }
  t.set(0, {-3.0f, 1e9f});
  EXPECT_EQ(t.position(0).x, 0.0f);
  EXPECT_EQ(t.position(0).y, 255.0f / 8);
}

}  // namespace
}  // namespace darm::tile_scheduler
