#include "actors/tile_scheduler/stream_groups.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/unit/tile_scheduler/random.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr Microseconds kSecond = 1'000'000;

StreamFormat format(std::uint32_t slots_per_side = 10) {
  StreamFormat f;
  f.phystex_size = slots_per_side * kSlotSize;
  return f;
}

std::vector<TileId> tiles(std::uint32_t first, std::uint32_t count) {
  std::vector<TileId> out;
  for (std::uint32_t i = 0; i < count; ++i) out.emplace_back(0, first + i);
  return out;
}

SessionId session(std::size_t number) { return SessionId{number + 1}; }

// Times that the tests below count on.
GroupOptions timed() {
  GroupOptions options;
  options.join_after = 2'000'000;
  options.split_after = 500'000;
  options.jumped = 0;  // a set that changes counts at once
  return options;
}

// 100 slots unless a test says otherwise.
class StreamGroupsTest : public ::testing::Test {
 protected:
  StreamId put(std::size_t who, std::vector<TileId> set, const StreamFormat& f = format()) {
    return groups_.put(session(who), f, std::move(set));
  }
  StreamId at(std::size_t who) { return *groups_.stream_of(session(who)); }
  // So much time passes, in updates. All moves.
  std::vector<GroupMove> wait(Microseconds time) {
    std::vector<GroupMove> all;
    for (const auto end = now_ + time; now_ < end;) {
      now_ += kSecond / 10;
      const auto moves = groups_.regroup(now_);
      all.insert(all.end(), moves.begin(), moves.end());
    }
    return all;
  }
  std::uint32_t next_ = 1;
  Microseconds now_ = 0;
  StreamGroups groups_{timed(), [this] { return StreamId{next_++}; }};
};

TEST_F(StreamGroupsTest, WhoSeesMuchTheSameSharesAStreamFromTheFirstLook) {
  const auto first = put(0, tiles(0, 60));
  EXPECT_EQ(put(1, tiles(10, 60)), first);
  EXPECT_EQ(put(2, tiles(20, 60)), first);
  EXPECT_EQ(groups_.members(first), (std::vector<SessionId>{session(0), session(1), session(2)}));
  EXPECT_EQ(groups_.union_of(first), 80u);
}

TEST_F(StreamGroupsTest, WhoDoesNotFitWithRoomBeginsAStream) {
  const auto first = put(0, tiles(0, 60));
  EXPECT_NE(put(1, tiles(26, 60)), first) << "86 of 100 slots";
  EXPECT_EQ(put(2, tiles(25, 60)), at(1)) << "where fewest tiles are missing";
}

TEST_F(StreamGroupsTest, WhoIsSetApartSharesWithOthersThatAreAndComesBack) {
  for (std::size_t i = 0; i < 4; ++i) put(i, tiles(0, 50));
  const auto together = at(0);
  auto apart = format();
  apart.lane = 4;
  put(1, tiles(0, 50), apart);
  put(3, tiles(0, 50), apart);
  EXPECT_EQ(at(1), together) << "until streams are looked at";
  const auto moves = groups_.regroup(now_);
  ASSERT_EQ(moves.size(), 2u);
  EXPECT_EQ(at(1), at(3));
  EXPECT_NE(at(1), together);
  EXPECT_EQ(groups_.members(together), (std::vector<SessionId>{session(0), session(2)}));
  EXPECT_TRUE(wait(10 * kSecond).empty()) << "the two do not join";
  put(1, tiles(0, 50));
  EXPECT_EQ(groups_.regroup(now_), (std::vector<GroupMove>{{session(1), together, true}}));
}

TEST_F(StreamGroupsTest, FormatsAreNotMixed) {
  const auto first = put(0, tiles(0, 60));
  auto other = format();
  other.chroma_444 = true;
  EXPECT_NE(put(1, tiles(0, 60), other), first);
  EXPECT_NE(put(2, tiles(0, 60), format(20)), first);
  EXPECT_TRUE(wait(10 * kSecond).empty());
}

TEST_F(StreamGroupsTest, OneThatMovesAwayIsSplitOffOnlyWhenTheUnionHasNotFittedForSomeTime) {
  const auto first = put(0, tiles(0, 60));
  put(1, tiles(0, 60));
  put(2, tiles(0, 60));
  put(2, tiles(500, 60));
  EXPECT_TRUE(wait(kSecond * 4 / 10).empty());
  put(2, tiles(0, 60));
  EXPECT_TRUE(wait(kSecond).empty()) << "back in time";
  put(2, tiles(500, 60));
  const auto moves = wait(kSecond);
  ASSERT_EQ(moves.size(), 1u);
  EXPECT_EQ(moves[0].session, session(2));
  EXPECT_TRUE(moves[0].split);
  EXPECT_EQ(at(0), first) << "the most stay";
  EXPECT_EQ(at(1), first);
  EXPECT_EQ(groups_.union_of(first), 60u);
}

TEST_F(StreamGroupsTest, AGroupThatMovesAwayStaysTogether) {
  for (std::size_t i = 0; i < 10; ++i) put(i, tiles(0, 60));
  for (std::size_t i = 6; i < 10; ++i) put(i, tiles(500 + static_cast<std::uint32_t>(i), 60));
  EXPECT_EQ(wait(kSecond).size(), 4u);
  EXPECT_EQ(groups_.streams(), 2u);
  for (std::size_t i = 6; i < 10; ++i) EXPECT_EQ(at(i), at(6));
}

TEST_F(StreamGroupsTest, WhoIsSplitOffGoesWhereThereIsRoom) {
  put(0, tiles(0, 60));
  put(1, tiles(0, 60));
  const auto there = put(2, tiles(500, 60));
  put(1, tiles(505, 60));
  EXPECT_EQ(wait(kSecond), (std::vector<GroupMove>{{session(1), there, true}}));
}

TEST_F(StreamGroupsTest, StreamsJoinWhenTheyWouldHaveFittedForSomeTime) {
  const auto first = put(0, tiles(0, 60));
  put(1, tiles(500, 60));
  put(2, tiles(500, 60));
  const auto second = at(1);
  EXPECT_TRUE(wait(10 * kSecond).empty());
  put(0, tiles(510, 60));
  EXPECT_TRUE(wait(kSecond).empty());
  EXPECT_EQ(wait(2 * kSecond), (std::vector<GroupMove>{{session(0), second, false}})) << "the fewer move";
  EXPECT_TRUE(groups_.members(first).empty());
  EXPECT_EQ(groups_.streams(), 1u);
}

TEST_F(StreamGroupsTest, BetweenRoomAndFullNothingChanges) {
  put(0, tiles(0, 60));
  put(1, tiles(10, 60));
  put(1, tiles(38, 60));  // 98: no longer with room
  put(2, tiles(500, 60));
  put(3, tiles(590, 60));
  put(3, tiles(530, 60));  // 90 together: not enough room to join
  EXPECT_TRUE(wait(20 * kSecond).empty());
  EXPECT_EQ(at(0), at(1));
  EXPECT_NE(at(2), at(3));
}

TEST_F(StreamGroupsTest, SetsLargerThanAPhysTexShareWhereItMakesThemHardlyLarger) {
  const auto first = put(0, tiles(0, 300));
  EXPECT_EQ(put(1, tiles(10, 300)), first) << "310 of the 315 that are a twentieth more";
  EXPECT_NE(put(2, tiles(100, 300)), first) << "each would be drawn coarser";
  EXPECT_TRUE(wait(10 * kSecond).empty());
}

TEST_F(StreamGroupsTest, WithoutSharingEverybodyHasAStream) {
  GroupOptions options;
  options.share = false;
  StreamGroups groups(options, [this] { return StreamId{next_++}; });
  for (std::size_t i = 0; i < 3; ++i) groups.put(session(i), format(), tiles(0, 10));
  EXPECT_TRUE(groups.regroup(10 * kSecond).empty());
  EXPECT_EQ(groups.streams(), 3u);
}

TEST_F(StreamGroupsTest, AStreamEndsWithItsLastMember) {
  const auto first = put(0, tiles(0, 60));
  put(1, tiles(0, 60));
  groups_.remove(session(0));
  EXPECT_EQ(groups_.members(first), std::vector<SessionId>{session(1)});
  groups_.remove(session(1));
  groups_.remove(session(1));
  EXPECT_EQ(groups_.streams(), 0u);
  EXPECT_FALSE(groups_.stream_of(session(1)));
  EXPECT_NE(put(1, tiles(0, 60)), first) << "streams are not named twice";
}

// ---- any views ------------------------------------------------------------------------------------------------------

// Cameras on a line see the tiles around them; a few jump.
class AnyViews : public StreamGroupsTest, public ::testing::WithParamInterface<std::uint32_t> {
 protected:
  struct View {
    double at = 0;
    std::uint32_t size = 40;
    bool there = false;
  };
  AnyViews() : random_(GetParam()), views_(60) {}
  double number(double limit) { return limit * random_() / 4294967296.0; }
  void look(std::size_t i) {
    auto& v = views_[i];
    v.there = true;
    put(i, tiles(static_cast<std::uint32_t>(v.at), v.size), i % 7 == 0 ? format(11) : format());
  }
  void appear(std::size_t i) {
    views_[i].at = number(400);
    views_[i].size = 20 + random_() % (i % 10 == 0 ? 300 : 70);
    look(i);
  }
  void move_all() {
    for (std::size_t i = 0; i < views_.size(); ++i) {
      auto& v = views_[i];
      if (!v.there) {
        if (random_() % 4 == 0) appear(i);
      } else if (random_() % 200 == 0) {
        groups_.remove(session(i));
        v.there = false;
      } else {
        if (random_() % 50 == 0) v.at = number(400);
        v.at = std::clamp(v.at + number(4) - 2, 0.0, 400.0);
        look(i);
      }
    }
  }
  // Everybody is in exactly one stream, and streams count right.
  void check() {
    std::map<StreamId, std::vector<SessionId>> streams;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const auto stream = groups_.stream_of(session(i));
      ASSERT_EQ(stream.has_value(), views_[i].there);
      if (stream) streams[*stream].push_back(session(i));
    }
    EXPECT_EQ(groups_.streams(), streams.size());
    for (const auto& [id, members] : streams) {
      ASSERT_EQ(groups_.members(id), members);
      std::set<std::uint32_t> all;
      for (const auto m : members) {
        const auto& v = views_[static_cast<std::size_t>(m) - 1];
        for (std::uint32_t t = 0; t < v.size; ++t) all.insert(static_cast<std::uint32_t>(v.at) + t);
        EXPECT_EQ(static_cast<std::size_t>(m) % 7 == 1, static_cast<std::size_t>(members.front()) % 7 == 1)
            << "one format a stream";
      }
      EXPECT_EQ(groups_.union_of(id), all.size());
    }
  }
  // Every union fits its slots, or is hardly larger than what one of it needs anyway.
  void check_fits() {
    const GroupLimit limit = GroupOptions().stay;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (!views_[i].there) continue;
      double largest = 0;
      for (const auto m : groups_.members(at(i)))
        largest = std::max(largest, double(views_[static_cast<std::size_t>(m) - 1].size));
      const double slots = i % 7 == 0 ? 121 : 100;
      EXPECT_LE(double(groups_.union_of(at(i))), std::max(limit.slots * slots, limit.own * largest));
    }
  }

  testing::Random random_;
  std::vector<View> views_;
};

TEST_P(AnyViews, AreEachInOneStreamWhateverHappens) {
  for (int update = 0; update < 200; ++update) {
    move_all();
    wait(kSecond / 10);
    ASSERT_NO_FATAL_FAILURE(check());
  }
}

TEST_P(AnyViews, ThatRestFitTheirStreamsAndStayInThem) {
  for (int round = 0; round < 4; ++round) {
    for (int update = 0; update < 30; ++update) {
      move_all();
      wait(kSecond / 10);
    }
    wait(8 * kSecond);
    check_fits();
    EXPECT_TRUE(wait(60 * kSecond).empty()) << "still views change nothing";
    check();
  }
}

// A hand that trembles, pictures that show a tile more or less: what has settled is not upset.
TEST_P(AnyViews, ThatTrembleAreNotJoinedAndSplitByTurns) {
  for (std::size_t i = 0; i < views_.size(); ++i) appear(i);
  wait(10 * kSecond);
  const auto place = views_;
  std::map<SessionId, int> moved;
  for (int update = 0; update < 600; ++update) {
    for (std::size_t i = 0; i < views_.size(); ++i) {
      views_[i].at = place[i].at + number(3);
      look(i);
    }
    for (const auto& m : wait(kSecond / 10)) ++moved[m.session];
  }
  for (const auto& [id, times] : moved) EXPECT_LE(times, 3) << static_cast<std::uint64_t>(id);
}

TEST_P(AnyViews, LeadToTheSameStreamsEachTime) {
  const auto run = [&] {
    std::vector<GroupMove> all;
    StreamGroups groups(timed(), [next = 1u]() mutable { return StreamId{next++}; });
    testing::Random random(GetParam());
    for (int update = 0; update < 100; ++update) {
      for (std::size_t i = 0; i < 30; ++i) groups.put(session(i), format(), tiles(random() % 100, 30 + random() % 50));
      const auto moves = groups.regroup(update * kSecond / 10);
      all.insert(all.end(), moves.begin(), moves.end());
    }
    return all;
  };
  EXPECT_EQ(run(), run());
}

INSTANTIATE_TEST_SUITE_P(Seeds, AnyViews, ::testing::Range(1u, 13u));

TEST(TileTally, CountsUnionsAsSetsComeAndGo) {
  testing::Random random(3);
  TileTally tally;
  std::vector<std::vector<TileId>> sets;
  for (int step = 0; step < 400; ++step) {
    if (sets.size() < 20 || random() % 2 == 0) {
      sets.push_back(tiles(random() % 100'000, random() % 800));
      tally.add(sets.back());
    } else {
      const auto i = random() % sets.size();
      tally.remove(sets[i]);
      sets.erase(sets.begin() + static_cast<std::ptrdiff_t>(i));
    }
    if (step % 20 != 0) continue;
    std::map<TileId, std::uint32_t> counts;
    for (const auto& set : sets)
      for (const auto tile : set) ++counts[tile];
    ASSERT_EQ(tally.distinct(), counts.size());
    ASSERT_EQ(tally.tiles().size(), counts.size());
    for (const auto& [tile, count] : counts) ASSERT_EQ(tally.count(tile), count);
  }
}

// Default times: 1 s until a split, 2 s until who has jumped counts again.
class JumpsTest : public StreamGroupsTest {
 protected:
  JumpsTest() {
    groups_ = StreamGroups(GroupOptions{}, [this] { return StreamId{next_++}; });
  }
};

TEST_F(JumpsTest, WhoLooksFromSomewhereElseEverySecondSplitsNobody) {
  for (std::size_t i = 0; i < 10; ++i) put(i, tiles(0, 60));
  const auto together = at(0);
  for (std::uint32_t second = 1; second <= 30; ++second) {
    for (std::size_t i = 7; i < 10; ++i) put(i, tiles(1000 * second + 100 * static_cast<std::uint32_t>(i), 60));
    ASSERT_TRUE(wait(kSecond).empty()) << second;
    ASSERT_EQ(groups_.union_of(together), 60u) << "nor does it keep anybody out";
  }
  EXPECT_EQ(put(10, tiles(10, 60)), together);
}

TEST_F(JumpsTest, WhoStaysWhereItHasJumpedToGetsAStreamForIt) {
  for (std::size_t i = 0; i < 8; ++i) put(i, tiles(0, 60));
  const auto together = at(0);
  put(3, tiles(1000, 60));
  EXPECT_TRUE(wait(2 * kSecond).empty());
  const auto moves = wait(2 * kSecond);
  ASSERT_EQ(moves.size(), 1u);
  EXPECT_EQ(moves[0].session, session(3));
  EXPECT_EQ(groups_.union_of(together), 60u);
  EXPECT_EQ(groups_.union_of(at(3)), 60u);
}

TEST_F(JumpsTest, OneOfFewIsPartedFromThemAsSoonAsItDoesNotFit) {
  for (std::size_t i = 0; i < 3; ++i) put(i, tiles(0, 60));
  put(2, tiles(1000, 60));
  EXPECT_EQ(wait(2 * kSecond).size(), 1u);
}

TEST_F(JumpsTest, AWalkIsNoJump) {
  for (std::size_t i = 0; i < 8; ++i) put(i, tiles(0, 60));
  for (std::uint32_t step = 1; step <= 5; ++step) {
    put(0, tiles(20 * step, 60));
    static_cast<void>(groups_.regroup(now_ += kSecond / 10));
  }
  EXPECT_EQ(groups_.union_of(at(1)), 120u) << "two thirds of what it sees it saw before";
}

TEST_F(JumpsTest, WhoLeavesTakesWithItWhatItCountedAndNoMore) {
  for (std::size_t i = 0; i < 9; ++i) put(i, tiles(0, 60));
  const auto together = at(0);
  put(7, tiles(1000, 20));
  put(8, tiles(2000, 20));
  EXPECT_EQ(groups_.union_of(together), 60u);
  groups_.remove(session(7));
  EXPECT_EQ(groups_.union_of(together), 60u);
  EXPECT_TRUE(wait(3 * kSecond).empty());
  EXPECT_EQ(groups_.union_of(together), 80u) << "the other has stayed";
  groups_.remove(session(8));
  EXPECT_EQ(groups_.union_of(together), 60u);
}

}  // namespace
}  // namespace darm::tile_scheduler
