#include "actors/tile_scheduler/tile_detail.hpp"

#include <gtest/gtest.h>

#include "actors/tile_scheduler/slot_allocation.hpp"

namespace darm::tile_scheduler {
namespace {

TEST(TileDetail, IsWhatHalvingTakesAway) {
  TileImage flat{};
  flat.y.fill(90);
  EXPECT_EQ(detail_of(flat), 0);
  TileImage board{};
  for (int y = 0; y < kSlotSize; ++y)
    for (int x = 0; x < kSlotSize; ++x)
      board.y[static_cast<std::size_t>(y * kSlotSize + x)] = (x + y) % 2 == 0 ? 100 : 80;
  EXPECT_FLOAT_EQ(detail_of(board), 100);  // each texel is 10 off its block's mean
  TileImage ramp{};
  for (std::size_t i = 0; i < ramp.y.size(); ++i) ramp.y[i] = static_cast<std::uint8_t>((i % kSlotSize) / 2 * 2);
  EXPECT_LT(detail_of(ramp), 2);
}

TEST(TileDetail, FactorsAreBoundedPowersOfTwo) {
  EXPECT_EQ(detail_factor(10, 10), 1);
  EXPECT_EQ(detail_factor(43, 10), 4);
  EXPECT_EQ(detail_factor(0, 10), 1.0f / 16);
  EXPECT_EQ(detail_factor(1e9f, 10), 8);
  EXPECT_EQ(detail_factor(5, 0), 1);
}

TEST(TileDetail, TheOnlySlotGoesWhereACoarserLevelWouldShow) {
  WeightedChain plain, rich;
  plain.chain.tiles = {TileId(0, 1), kNoTile, kNoTile, kNoTile};
  rich.chain.tiles = {TileId(0, 2), kNoTile, kNoTile, kNoTile};
  plain.weight = 0.6f;
  rich.weight = 0.4f;
  const std::vector<WeightedChain> chains{plain, rich};
  AllocationRequest request;
  request.chains = chains;
  request.slots = 1;
  request.coarse_level = 4;
  ASSERT_EQ(allocate_slots(request).tiles, std::vector<TileId>{TileId(0, 1)});
  request.detail = [](TileId tile) { return tile == TileId(0, 2) ? 400.0f : 10.0f; };
  EXPECT_EQ(allocate_slots(request).tiles, std::vector<TileId>{TileId(0, 2)});
}

}  // namespace
}  // namespace darm::tile_scheduler
