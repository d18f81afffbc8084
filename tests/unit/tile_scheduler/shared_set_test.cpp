#include "actors/tile_scheduler/shared_set.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "actors/tile_scheduler/slot_allocation.hpp"
#include "actors/tile_scheduler/view_demand.hpp"
#include "tests/unit/tile_scheduler/random.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr int kCoarse = 6;
constexpr Microseconds kSecond = 1'000'000;

// A picture of side * side samples on a flat surface around (x, y), each tile at a level of its own.
VisibleSet view_at(std::uint32_t x, std::uint32_t y, std::uint32_t side, std::uint32_t seed) {
  testing::Random random(seed);
  VisibleSet view;
  for (std::uint32_t i = 0; i < side; ++i)
    for (std::uint32_t j = 0; j < side; ++j) {
      Chain chain;
      for (int level = 0; level < kChainLength; ++level)
        chain.tiles[static_cast<std::size_t>(level)] = TileId(level, ((y + i) >> level) * 4096 + ((x + j) >> level));
      const auto count = std::exp(-static_cast<float>(random() % 300) / 100.0f);
      view.add(chain, count);
      view.add_samples(double{count});
    }
  return view;
}

Allocation allocate(const SharedSet& set, std::size_t slots) {
  const auto chains = chains_of(set.seen(false));
  AllocationRequest request;
  request.chains = chains;
  request.slots = slots;
  request.coarse_level = kCoarse;
  return allocate_slots(request, {});
}

// Levels coarser than sharp, on average over a picture, with these slots for all.
double bias(const VisibleSet& view, const SharedSet& set, const Allocation& all) {
  ChainIndex known;
  for (const auto& item : chains_of(set.seen(false))) known.insert(item.chain);
  double sum = 0;
  for (std::size_t c = 0; c < view.chains().size(); ++c)
    sum += double(view.counts()[c]) * all.served.at(known.find(view.chains()[c]));
  return sum / view.samples();
}

double weight_of(const SharedSet& set, const VisibleSet& view) {
  ChainIndex own;
  for (const auto& chain : view.chains()) own.insert(chain);
  double sum = 0;
  for (const auto& item : chains_of(set.seen(false)))
    if (own.find(item.chain) != ChainIndex::kAbsent) sum += double(item.weight);
  return sum;
}

TEST(SharedSet, ALookOfALargePictureCountsLikeOneOfASmallOne) {
  SharedSet set;
  const auto large = view_at(0, 0, 40, 1), small = view_at(100, 100, 3, 2);
  set.add(large);
  set.add(small);
  EXPECT_NEAR(weight_of(set, large), 0.5, 1e-4);
  EXPECT_NEAR(weight_of(set, small), 0.5, 1e-4);
}

TEST(SharedSet, LevelsCoarsenEvenlyOverViewsAlike) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    SharedSet set;
    std::vector<VisibleSet> views;
    for (std::uint32_t i = 0; i < 5; ++i) views.push_back(view_at(64 * i, 128, 16, seed));
    for (const auto& view : views) set.add(view);
    const auto all = allocate(set, 400);  // of 1280
    double least = 10, most = 0;
    for (const auto& view : views) {
      least = std::min(least, bias(view, set, all));
      most = std::max(most, bias(view, set, all));
    }
    EXPECT_GT(least, 0.1);
    EXPECT_LT(most - least, 0.25) << "levels";
  }
}

TEST(SharedSet, AHugeViewDoesNotStarveASmallOne) {
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    SharedSet set;
    const auto huge = view_at(0, 0, 40, seed), small = view_at(200, 200, 6, seed + 100);
    set.add(huge);
    set.add(small);
    const auto all = allocate(set, 256);
    EXPECT_LE(bias(small, set, all), bias(huge, set, all) + 0.05);
    EXPECT_LT(bias(small, set, all), 0.6);
  }
}

TEST(SharedSet, HoldsWhatWasSeenASecondAgoAndNotWhatWasSeenLongBefore) {
  SharedSet set;
  std::uint32_t at = 0;
  for (Microseconds now = 0; now < 10 * kSecond; now += 100'000, ++at) {
    if (set.stale(now)) set.renew(now);
    set.note_change();
    set.add(view_at(10 * at, 0, 1, 1));
    std::set<std::uint32_t> seen;
    for (const auto& item : chains_of(set.seen(false))) seen.insert(item.chain.tiles[0].index() / 10);
    for (std::uint32_t k = at < 9 ? 0 : at - 9; k <= at; ++k) EXPECT_TRUE(seen.contains(k)) << k << " at " << at;
    EXPECT_LE(seen.size(), 21u);
  }
}

TEST(SharedSet, IsLeftAloneOnceEverybodyRests) {
  SharedSet set;
  set.note_change();
  set.add(view_at(0, 0, 8, 1));
  int renewals = 0;
  for (Microseconds now = 0; now < 20 * kSecond; now += 100'000) {
    if (!set.stale(now)) continue;
    ++renewals;
    set.renew(now);
    set.add(view_at(50, 0, 8, 1), SharedSet::kRests);
  }
  EXPECT_EQ(renewals, 2) << "one for the change, one to forget what was before";
  EXPECT_EQ(chains_of(set.seen(true)).size(), 64u);
}

TEST(SharedSet, WhoMovesIsNotOutweighedByWhoRests) {
  SharedSet set;
  const auto still = view_at(0, 0, 10, 1);
  set.note_change();
  set.renew(0);
  set.add(still, SharedSet::kRests);
  for (std::uint32_t i = 0; i < 10; ++i) set.add(view_at(100 + i, 100, 10, i));
  EXPECT_NEAR(weight_of(set, still), 0.5, 1e-3);
}

TEST(SharedSet, RenewingThatTakesLongIsDoneLessOften) {
  SharedSet set;
  set.note_change();
  set.renew(0);
  set.renewed(400'000, 0);
  set.note_change();
  EXPECT_FALSE(set.stale(3'999'999));
  EXPECT_TRUE(set.stale(4'000'000));
  set.renew(4'000'000);
  set.renewed(60'000'000, 4'000'000);
  set.note_change();
  EXPECT_TRUE(set.stale(9'000'000));
}

TEST(SharedSet, AnEmptyLookIsNoLook) {
  SharedSet set;
  set.add(VisibleSet());
  EXPECT_TRUE(chains_of(set.seen(false)).empty());
  set.add(view_at(0, 0, 2, 1));
  double weight = 0;
  for (const auto& item : chains_of(set.seen(false))) weight += double(item.weight);
  EXPECT_NEAR(weight, 1, 1e-5);
}

TEST(KnownShare, IsByWeight) {
  const auto view = view_at(0, 0, 10, 5);
  ChainIndex known;
  EXPECT_EQ(known_share(view, known), 0.0f);
  double part = 0;
  for (std::size_t c = 0; c < 30; ++c) {
    known.insert(view.chains()[c]);
    part += double(view.counts()[c]);
  }
  EXPECT_NEAR(known_share(view, known), part / view.samples(), 1e-5);
  EXPECT_EQ(known_share(VisibleSet(), known), 1.0f);
}

TEST(SignificantTiles, AreTheFewThatShowMostOfAView) {
  SharedSet set;
  auto view = view_at(0, 0, 10, 5);
  const auto heavy = view.chains()[37];
  view.add(heavy, 1000);
  view.add_samples(1000);
  set.add(view);
  const auto chains = chains_of(set.seen(false));
  EXPECT_EQ(significant_tiles(chains, 0.9), std::vector<TileId>{heavy.tiles[0]});
  EXPECT_EQ(significant_tiles(chains, 1.0).size(), 100u);
  EXPECT_EQ(sharp_tiles(chains).size(), 100u);
  EXPECT_TRUE(significant_tiles({}, 0.9).empty());
}

TEST(SharedSet, ThoseAtTheVerySamePlaceAreGatheredOnce) {
  const auto camera = look_at({0, 0, 0}, {1, 0, 0}, 60), other = look_at({0, 0, 1}, {1, 0, 0}, 60);
  const ViewChanged here(SessionId{1}, 1, camera, {}, {}), also_here(SessionId{2}, 9, camera, {}, {});
  const ViewChanged there(SessionId{3}, 1, other, {}, {});
  const auto little = view_at(0, 0, 4, 1), much = view_at(0, 0, 20, 1), elsewhere = view_at(90, 90, 9, 2);
  const std::vector<MemberLook> looks{{&here, &little, 1}, {&there, &elsewhere, 2}, {&also_here, &much, 10}};
  const auto joined = join_same_views(looks);
  ASSERT_EQ(joined.size(), 2u);
  EXPECT_EQ(joined[0].samples, &much) << "what the one that knows most has seen";
  EXPECT_EQ(joined[0].looks, 11) << "counts for both";
  EXPECT_EQ(joined[1].samples, &elsewhere);
  EXPECT_EQ(joined[1].looks, 2);
}

TEST(SharedSet, WhoseFirstLookFromAPlaceIsUnderWayIsLikeNobody) {
  const auto view = view_at(0, 0, 4, 1);
  const std::vector<MemberLook> looks{{nullptr, &view, 1}, {nullptr, &view, 1}};
  EXPECT_EQ(join_same_views(looks).size(), 2u);
}

TEST(SharedSet, GatheringThoseAtOnePlaceOnceChangesNothing) {
  const auto camera = look_at({0, 0, 0}, {1, 0, 0}, 60), other = look_at({0, 0, 1}, {1, 0, 0}, 60);
  const ViewChanged here(SessionId{1}, 1, camera, {}, {}), there(SessionId{2}, 1, other, {}, {});
  const auto same = view_at(0, 0, 12, 1), elsewhere = view_at(7, 3, 9, 2);
  std::vector<MemberLook> looks(20, MemberLook{&here, &same, SharedSet::kRests});
  looks.push_back({&there, &elsewhere, 1});
  SharedSet one_by_one, together;
  for (const auto& look : looks) one_by_one.add(*look.samples, look.looks);
  for (const auto& look : join_same_views(looks)) together.add(*look.samples, look.looks);
  EXPECT_NEAR(weight_of(together, same), weight_of(one_by_one, same), 1e-4);
  EXPECT_NEAR(weight_of(together, elsewhere), weight_of(one_by_one, elsewhere), 1e-4);
}

}  // namespace
}  // namespace darm::tile_scheduler
