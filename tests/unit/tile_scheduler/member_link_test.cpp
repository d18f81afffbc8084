#include "actors/tile_scheduler/member_link.hpp"

#include <gtest/gtest.h>

namespace darm::tile_scheduler {
namespace {

constexpr Microseconds kSecond = 1'000'000;
constexpr double kKey = 1e6;  // bytes

class MemberLinkTest : public ::testing::Test {
 protected:
  // Settles ten times a second. True if the lane changed.
  bool run(Microseconds time) {
    bool changed = false;
    for (const auto end = now + time; now < end; now += kSecond / 10) changed = link.settle(kKey, now) || changed;
    return changed;
  }
  void be(LinkState state, double rate) { link.changed(state, rate, now); }
  void go_apart(double rate) {
    be(LinkState::kFree, rate);
    run(2 * kSecond);
  }

  MemberLink link{LinkOptions{}};
  Microseconds now = kSecond;
};

TEST_F(MemberLinkTest, AFastOneKeepsUp) {
  be(LinkState::kFree, 10e6);
  EXPECT_FALSE(run(100 * kSecond));
  EXPECT_EQ(link.lane(), 0);
}

TEST_F(MemberLinkTest, OneThatAKeyFrameWouldTakeLongIsSetApartBeforeItHasToBear) {
  be(LinkState::kLoading, 625e3);
  EXPECT_TRUE(run(kSecond));
  EXPECT_EQ(link.lane(), lane_of(625e3));
}

TEST_F(MemberLinkTest, OneThatStandsIsSetApart) {
  be(LinkState::kFull, 1.5e6);
  EXPECT_FALSE(run(kSecond / 2)) << "a moment may happen to anybody";
  be(LinkState::kFree, 1.5e6);
  EXPECT_FALSE(run(kSecond / 2));
  be(LinkState::kFull, 1.5e6);
  EXPECT_TRUE(run(2 * kSecond));
}

TEST_F(MemberLinkTest, AFastOneThatStallsIsLeftWhereItIs) {
  be(LinkState::kFull, 10e6);
  EXPECT_FALSE(run(9 * kSecond)) << "apart it would cost a stream, and a key frame to come back";
}

TEST_F(MemberLinkTest, LoadingTheSceneIsNoTrouble) {
  be(LinkState::kLoading, 10e6);
  EXPECT_FALSE(run(20 * kSecond));
}

TEST_F(MemberLinkTest, OneThatLosesPicturesNowAndAgainIsSetApart) {
  link.lost_pictures(now);
  EXPECT_FALSE(run(61 * kSecond)) << "once may happen to anybody";
  link.lost_pictures(now);
  EXPECT_FALSE(run(3 * kSecond)) << "or once a minute";
  link.lost_pictures(now);
  EXPECT_TRUE(run(kSecond));
}

TEST_F(MemberLinkTest, ComesBackWhenItIsFastForAMinuteAndTheNextTimeForTwo) {
  go_apart(100e3);
  ASSERT_NE(link.lane(), 0);
  be(LinkState::kFree, 10e6);
  run(50 * kSecond);
  EXPECT_NE(link.lane(), 0);
  run(15 * kSecond);
  EXPECT_EQ(link.lane(), 0);
  go_apart(100e3);
  be(LinkState::kFree, 10e6);
  run(100 * kSecond);
  EXPECT_NE(link.lane(), 0);
  run(25 * kSecond);
  EXPECT_EQ(link.lane(), 0);
}

TEST_F(MemberLinkTest, OneThatIsJustFastEnoughDoesNotComeBack) {
  go_apart(625e3);
  be(LinkState::kFree, 700e3);
  run(300 * kSecond);
  EXPECT_NE(link.lane(), 0);
}

TEST_F(MemberLinkTest, LanesDoNotFollowEveryMeasure) {
  go_apart(600e3);
  const auto lane = link.lane();
  for (int i = 0; i < 60; ++i) {
    be(LinkState::kFree, i % 2 == 0 ? 350e3 : 1.1e6);
    run(kSecond);
  }
  EXPECT_EQ(link.lane(), lane);
  be(LinkState::kFree, 100e3);
  run(6 * kSecond);
  EXPECT_EQ(link.lane(), lane_of(100e3));
  be(LinkState::kFree, 600e3);
  run(10 * kSecond);
  EXPECT_EQ(link.lane(), lane_of(100e3)) << "to a faster one later: it costs a key frame and serves only itself";
  run(15 * kSecond);
  EXPECT_EQ(link.lane(), lane_of(600e3));
}

TEST_F(MemberLinkTest, LanesAreInOrderAndHoldTheUsualLinesApart) {
  std::uint8_t before = 0;
  for (const double mbit : {0.1, 1.0, 2.0, 5.0, 10.0}) {
    const auto lane = lane_of(mbit * 125e3);
    EXPECT_EQ(lane, before + 1) << mbit;
    before = lane;
  }
  EXPECT_EQ(lane_of(0), 1);
  EXPECT_EQ(lane_of(1e12), before);
}

TEST_F(MemberLinkTest, TheNextFrameWaitsUntilTheLinkIsDoneWithTheLast) {
  be(LinkState::kFree, 625e3);
  EXPECT_TRUE(link.ready(now));
  link.sent(250'000, now);  // .4 s, and a fifth of the link is left to others
  EXPECT_FALSE(link.ready(now + 450'000));
  EXPECT_TRUE(link.ready(now + 550'000));
  be(LinkState::kFull, 625e3);
  EXPECT_FALSE(link.ready(now + kSecond));
}

TEST_F(MemberLinkTest, ARateThatCannotBeDoesNotSilenceIt) {
  be(LinkState::kFree, 1e-3);
  link.sent(1'000'000, now);
  EXPECT_TRUE(link.ready(now + 2 * kSecond));
  EXPECT_GT(link.most_bytes(false), 0u);
}

TEST_F(MemberLinkTest, OthersWaitForItAMomentOnly) {
  be(LinkState::kFull, 625e3);
  EXPECT_TRUE(link.worth_waiting_for(now + kSecond / 2));
  EXPECT_FALSE(link.worth_waiting_for(now + 2 * kSecond));
  be(LinkState::kFull, 625e3);
  EXPECT_FALSE(link.worth_waiting_for(now + 2 * kSecond)) << "told again is not full anew";
  be(LinkState::kLoading, 625e3);
  EXPECT_FALSE(link.worth_waiting_for(now));
}

TEST_F(MemberLinkTest, AFrameTakesTheLinkAPartOfASecond) {
  EXPECT_EQ(link.most_bytes(true), 0u) << "nothing is known";
  be(LinkState::kFree, 625e3);
  EXPECT_LT(link.most_bytes(true), 625'000u);
  EXPECT_LT(link.most_bytes(false), link.most_bytes(true));
}

}  // namespace
}  // namespace darm::tile_scheduler
