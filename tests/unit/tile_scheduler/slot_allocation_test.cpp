#include "actors/tile_scheduler/slot_allocation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <unordered_set>

#include "tests/unit/tile_scheduler/random.hpp"

namespace darm::tile_scheduler {
namespace {

// Chains of a quadtree of tiles: the tile of a position at level l + 1 holds four tiles of level l, as on a big flat
// patch.
Chain quad_chain(int level, std::uint32_t x, std::uint32_t y, int coarse) {
  Chain c;
  for (int i = 0; i < kChainLength && level + i <= coarse; ++i)
    c.tiles[static_cast<std::size_t>(i)] = TileId(level + i, (y >> i) * 4096 + (x >> i));
  return c;
}

struct RandomView {
  std::vector<WeightedChain> chains;
  int coarse = 6;
  explicit RandomView(std::uint32_t seed) {
    testing::Random rng(seed);
    const int count = 20 + static_cast<int>(rng() % 600);
    const std::uint32_t side = 4 + rng() % 60;
    std::unordered_set<Chain, ChainHash> seen;
    for (int i = 0; i < count; ++i) {
      auto chain = quad_chain(static_cast<int>(rng() % 5), rng() % side, rng() % side, coarse);
      // Patches lie elsewhere at each level: some chains share a coarse tile with strangers.
      if (rng() % 3 == 0) chain.tiles[1] = TileId(chain.sharp_level() + 1, rng() % 20);
      if (!seen.insert(chain).second) continue;
      chains.push_back({chain, std::exp(-static_cast<float>(rng() % 800) / 100.0f)});
    }
  }
  [[nodiscard]] AllocationRequest request(std::size_t slots) const {
    AllocationRequest r;
    r.chains = chains;
    r.slots = slots;
    r.coarse_level = coarse;
    return r;
  }
};

double benefit_of(const RandomView& view, const std::vector<TileId>& tiles) {
  const std::set<TileId> held(tiles.begin(), tiles.end());
  double sum = 0;
  for (const auto& [chain, weight] : view.chains) {
    int position = 0;
    while (position < kChainLength && !held.contains(chain.tiles[static_cast<std::size_t>(position)])) ++position;
    sum += double(weight) *
           (serving_loss(chain, kServedByCoarse, view.coarse, {}) - serving_loss(chain, position, view.coarse, {}));
  }
  return sum;
}

TEST(SlotAllocation, NeverExceedsTheSlotsAndEveryTileServesSomeone) {
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    const RandomView view(seed);
    for (const std::size_t slots : {0u, 1u, 7u, 50u, 200u, 5000u}) {
      const auto a = allocate_slots(view.request(slots));
      ASSERT_LE(a.tiles.size(), slots);
      ASSERT_EQ(std::set(a.tiles.begin(), a.tiles.end()).size(), a.tiles.size());
      ASSERT_FALSE(std::count(a.tiles.begin(), a.tiles.end(), kNoTile));
      for (const auto w : a.weights) ASSERT_GT(w, 0);
      ASSERT_NEAR(a.benefit, benefit_of(view, a.tiles), 1e-4 * (1 + a.benefit));
    }
  }
}

TEST(SlotAllocation, ServesEveryChainByTheFinestTileGranted) {
  for (std::uint32_t seed = 1; seed <= 30; ++seed) {
    const RandomView view(seed);
    const auto a = allocate_slots(view.request(60));
    const std::set<TileId> held(a.tiles.begin(), a.tiles.end());
    ASSERT_EQ(a.served.size(), view.chains.size());
    for (std::size_t c = 0; c < a.served.size(); ++c) {
      ASSERT_LE(a.served[c], kServedByCoarse);
      for (std::size_t i = 0; i < a.served[c] && i < kChainLength; ++i)
        ASSERT_FALSE(held.contains(view.chains[c].chain.tiles[i]));
      if (a.served[c] < kServedByCoarse) {
        ASSERT_TRUE(held.contains(view.chains[c].chain.tiles[a.served[c]]));
      }
    }
  }
}

// However few the slots: CoarseTex, which a client always has whole, stands in, and never for what has a tile.
TEST(SlotAllocation, NoSampleIsWithoutALevelThatIsThere) {
  testing::Random rng(3);
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    const RandomView view(seed);
    for (const std::size_t slots : {0u, 1u, 9u, 64u}) {
      auto request = view.request(slots);
      request.moves = static_cast<Moves>(rng() % 3);
      const auto before = allocate_slots(view.request(slots)).tiles;
      request.residents = before;
      request.available = [&](TileId t) { return (t.index() + seed) % 3 != 0; };
      const auto a = allocate_slots(request);
      const std::set<TileId> held(a.tiles.begin(), a.tiles.end());
      ASSERT_EQ(a.served.size(), view.chains.size());
      for (std::size_t c = 0; c < a.served.size(); ++c) {
        const auto& tiles = view.chains[c].chain.tiles;
        if (a.served[c] < kServedByCoarse) {
          ASSERT_TRUE(held.contains(tiles[a.served[c]]));
        } else {
          ASSERT_EQ(a.served[c], kServedByCoarse);
          for (const auto tile : tiles) ASSERT_FALSE(held.contains(tile));
        }
      }
    }
  }
}

TEST(SlotAllocation, AViewThatRestsGivesAResidentUpOnlyForATileThatBringsTwiceAsMuch) {
  // Two tiles of one level, one slot. The one that is there shows `held`, the other `wanted`.
  const auto stays = [](float held, float wanted, Moves moves) {
    std::vector<WeightedChain> chains{{Chain{}, held}, {Chain{}, wanted}};
    chains[0].chain.tiles[0] = TileId(0, 0);
    chains[1].chain.tiles[0] = TileId(0, 1);
    const std::vector<TileId> residents{TileId(0, 0)};
    AllocationRequest request{.chains = chains, .residents = residents, .losses = {}};
    request.slots = 1;
    request.coarse_level = 6;
    request.moves = moves;
    return allocate_slots(request).tiles == residents;
  };
  EXPECT_TRUE(stays(0.4f, 0.7f, Moves::kFew));
  EXPECT_FALSE(stays(0.3f, 0.7f, Moves::kFew));
  EXPECT_FALSE(stays(0.4f, 0.7f, Moves::kFreely));
  EXPECT_TRUE(stays(0.0011f, 0.002f, Moves::kHardlyAny));
  EXPECT_FALSE(stays(0.1f, 0.7f, Moves::kHardlyAny)) << "seven times as much is lost as would be";
}

TEST(SlotAllocation, GrantsEverySharpTileWhenTheyFit) {
  const RandomView view(3);
  const auto a = allocate_slots(view.request(5000));
  for (const auto position : a.served) EXPECT_EQ(position, 0);
}

TEST(SlotAllocation, BenefitDoesNotFallWithMoreSlots) {
  for (std::uint32_t seed = 1; seed <= 30; ++seed) {
    const RandomView view(seed);
    double before = 0;
    for (std::size_t slots = 1; slots < 400; slots = slots * 3 / 2 + 1) {
      const double now = allocate_slots(view.request(slots)).benefit;
      ASSERT_GE(now, before * (1 - 1e-6)) << "seed " << seed << " slots " << slots;
      before = now;
    }
  }
}

TEST(SlotAllocation, BeatsRandomChoices) {
  testing::Random rng(5);
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const RandomView view(seed);
    std::set<TileId> all;
    for (const auto& c : view.chains)
      for (const auto t : c.chain.tiles)
        if (t != kNoTile) all.insert(t);
    std::vector<TileId> tiles(all.begin(), all.end());
    const std::size_t slots = tiles.size() / 5;
    const double greedy = allocate_slots(view.request(slots)).benefit;
    for (int trial = 0; trial < 20; ++trial) {
      std::shuffle(tiles.begin(), tiles.end(), rng);
      const std::vector<TileId> choice(tiles.begin(), tiles.begin() + static_cast<std::ptrdiff_t>(slots));
      ASSERT_GE(greedy, benefit_of(view, choice));
    }
  }
}

TEST(SlotAllocation, TradingOneTileForAnotherGainsNextToNothing) {
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    const RandomView view(seed);
    for (const std::size_t slots : {5u, 15u}) {
      const auto chosen = allocate_slots(view.request(slots)).tiles;
      if (chosen.size() < slots) continue;  // everything fits
      const double benefit = benefit_of(view, chosen);
      std::set<TileId> all;
      for (const auto& c : view.chains)
        for (const auto t : c.chain.tiles)
          if (t != kNoTile) all.insert(t);
      const std::vector<TileId> others(all.begin(), all.end());
      testing::Random rng(seed);
      double best = benefit;
      for (int trade = 0; trade < 300; ++trade) {
        auto trial = chosen;
        trial[rng() % trial.size()] = others[rng() % others.size()];
        best = std::max(best, benefit_of(view, trial));
      }
      EXPECT_LE(best, 1.05 * benefit) << "seed " << seed << ", " << slots << " slots";
    }
  }
}

TEST(SlotAllocation, MeasuredLossesStandInPlaceOfTheTable) {
  const RandomView view(3);
  std::vector<ChainLoss> losses;
  for (const auto& c : view.chains) {
    ChainLoss loss;
    for (int i = 0; i <= kChainLength; ++i)
      loss[static_cast<std::size_t>(i)] = 7 * serving_loss(c.chain, i, view.coarse, {});
    losses.push_back(loss);
  }
  auto measured = view.request(40);
  measured.losses = losses;
  const auto by_table = allocate_slots(view.request(40));
  const auto by_measure = allocate_slots(measured);
  EXPECT_EQ(by_measure.tiles, by_table.tiles);  // the unit does not matter
  EXPECT_NEAR(by_measure.benefit, 7 * by_table.benefit, 1e-3 * by_measure.benefit);
}

TEST(SlotAllocation, StillCameraCausesNoChurn) {
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    const RandomView view(seed);
    for (const std::size_t slots : {5u, 40u, 120u}) {
      const auto first = allocate_slots(view.request(slots));
      auto again = view.request(slots);
      again.residents = first.tiles;
      const auto second = allocate_slots(again);
      ASSERT_EQ(first.tiles, second.tiles) << "seed " << seed;
    }
  }
}

TEST(SlotAllocation, SmallChangesOfWeightMoveNothingOut) {
  testing::Random rng(11);
  std::uniform_real_distribution<float> noise(0.97f, 1.03f);
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    RandomView view(seed);
    auto held = allocate_slots(view.request(60)).tiles;
    for (auto& c : view.chains) c.weight *= noise(rng);
    auto again = view.request(60);
    again.residents = held;
    auto now = allocate_slots(again).tiles;
    std::sort(held.begin(), held.end());
    std::sort(now.begin(), now.end());
    std::vector<TileId> lost;
    std::set_difference(held.begin(), held.end(), now.begin(), now.end(), std::back_inserter(lost));
    EXPECT_TRUE(lost.empty()) << "seed " << seed;
  }
}

TEST(SlotAllocation, GrantsOnlyAvailableTiles) {
  const RandomView view(8);
  auto request = view.request(100);
  request.available = [](TileId t) { return t.index() % 2 == 0; };
  for (const auto t : allocate_slots(request).tiles) EXPECT_EQ(t.index() % 2, 0u);
}

TEST(SlotAllocation, LevelsCoarsenEvenlyOverSamplesOfEqualWeight) {
  // A big flat surface at one sharp level, all tiles alike: whatever the slots, samples differ by at most one level.
  std::vector<WeightedChain> chains;
  for (std::uint32_t y = 0; y < 32; ++y)
    for (std::uint32_t x = 0; x < 32; ++x) chains.push_back({quad_chain(0, x, y, 6), 1.0f / 1024});
  for (const std::size_t slots : {16u, 40u, 64u, 100u, 256u, 500u, 900u}) {
    AllocationRequest request;
    request.chains = chains;
    request.slots = slots;
    request.coarse_level = 6;
    const auto a = allocate_slots(request);
    const auto [low, high] = std::minmax_element(a.served.begin(), a.served.end());
    EXPECT_LE(*high - *low, 2) << slots << " slots";
    EXPECT_LT(*high, kServedByCoarse) << slots << " slots";
  }
}

}  // namespace
}  // namespace darm::tile_scheduler
