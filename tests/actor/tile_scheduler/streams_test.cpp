// Streams that sessions share, as the tile scheduler runs them.
#include <gtest/gtest.h>

#include "actors/tile_scheduler/tile_scheduler_actor.hpp"
#include "tests/actor/tile_scheduler/scheduler_and_neighbours.hpp"

namespace darm::tile_scheduler {
namespace {

class SharedStreams : public TileScheduler {
 protected:
  using TileScheduler::TileScheduler;
  // So many updates of a working pipeline.
  void run(int updates, std::uint32_t version = 1) {
    for (int i = 0; i < updates; ++i) {
      shade_all(version);
      finish_all();
      tick();
    }
    finish_all();
  }
  void finish_all() {
    for (const auto stream : heard_.encoders)
      if (!heard_.frames[stream].empty()) finish_frame(stream);
  }
  void both_look_ahead() {
    open(ann_);
    open(bob_);
    look(ann_, 1, ahead_);
    look(bob_, 1, ahead_);
    run(10);
  }
  std::size_t keys(StreamId stream) {
    const auto& frames = heard_.frames[stream];
    return static_cast<std::size_t>(std::count_if(frames.begin(), frames.end(), [](const auto& f) { return f.key; }));
  }
  std::set<CameraSequence> answered(SessionId id) {
    std::set<CameraSequence> out;
    for (const auto& [stream, frames] : heard_.frames)
      for (const auto& f : frames)
        for (const auto& a : f.answers)
          if (a.session == id) out.insert(a.sequence);
    for (const auto& n : heard_.no_changes)
      if (n.answer.session == id) out.insert(n.answer.sequence);
    return out;
  }
  const SessionId bob_{2};
  const SessionId cid_{3};
  const StreamId second_{2};
};

TEST_F(SharedStreams, TwoWhoSeeTheSameShareAnEncoderAndEachGetsItsAnswer) {
  open(ann_);
  open(bob_);
  look(ann_, 7, ahead_);
  look(bob_, 3, ahead_);
  run(8);
  EXPECT_EQ(heard_.encoders, std::set<StreamId>{first_});
  EXPECT_EQ(heard_.receivers[first_], (std::vector<SessionId>{ann_, bob_}));
  EXPECT_EQ(answered(ann_), std::set<CameraSequence>{7});
  EXPECT_EQ(answered(bob_), std::set<CameraSequence>{3});
}

TEST_F(SharedStreams, EachFrameTellsEachMemberTheErrorOfItsOwnView) {
  open(ann_);
  open(bob_);
  look(ann_, 1, ahead_);
  run(8);
  look(bob_, 1, aside_);  // its tiles have no pictures yet
  for (int i = 0; i < 4; ++i) {
    finish_all();
    tick();
  }
  const auto& frame = heard_.frames[first_].back();
  ASSERT_EQ(frame.errors.size(), 2u);
  EXPECT_EQ(frame.errors[0].session, ann_);
  EXPECT_LT(frame.errors[0].error, 0.05f);
  EXPECT_GT(frame.errors[1].error, 0.05f);
  EXPECT_GT(frame.error, frame.errors[0].error);
  EXPECT_LT(frame.error, frame.errors[1].error);
}

TEST_F(SharedStreams, SessionsOfDifferentFormatDoNotShare) {
  open(ann_);
  open(bob_, 2048);
  look(ann_, 1, ahead_);
  look(bob_, 1, ahead_);
  run(40);
  EXPECT_EQ(heard_.encoders.size(), 2u);
  EXPECT_EQ(heard_.receivers[first_], std::vector<SessionId>{ann_});
}

TEST_F(SharedStreams, APictureThatSomebodyLooksAtIsNotLookedForTwice) {
  open(ann_);
  look(ann_, 1, ahead_);
  run(90);
  const auto work = heard_.work.back().work->size();
  open(bob_);
  system_.clear_log();
  look(bob_, 1, ahead_);
  run(5);
  for (const auto& handled : system_.messages_log()) EXPECT_NE(handled.message, "ViewTraced");
  EXPECT_EQ(answered(bob_), std::set<CameraSequence>{1});
  EXPECT_EQ(heard_.work.back().work->size(), work);
  look(ann_, 2, aside_);
  look(bob_, 2, aside_);
  run(90);
  int traces = 0;
  for (const auto& handled : system_.messages_log()) traces += handled.message == "ViewTraced" ? 1 : 0;
  EXPECT_LE(traces, kAllPasses) << "of one view";
  EXPECT_TRUE(answered(ann_).contains(2) && answered(bob_).contains(2));
}

TEST_F(SharedStreams, WhatBothSeeHasOneSlot) {
  open(ann_);
  look(ann_, 1, ahead_);
  run(80);
  const auto alone = heard_.frames[first_].back().frame;
  open(bob_);
  look(bob_, 1, ahead_);
  run(80);
  ASSERT_GT(heard_.frames[first_].back().frame, alone);
  std::set<TileId> tiles;
  for (const auto& edit : heard_.frames[first_].back().edits) tiles.insert(edit.tile);
  for (const auto& f : heard_.frames[first_]) {
    if (f.frame <= alone || f.key) continue;
    for (const auto& edit : f.edits) EXPECT_NE(edit.slot, kNoSlot) << "nothing has to go";
  }
}

TEST_F(SharedStreams, ALateJoinerGetsAKeyFrameAndTheStreamGoesOn) {
  open(ann_);
  look(ann_, 1, ahead_);
  run(20);
  const auto before = heard_.frames[first_].size();
  ASSERT_EQ(keys(first_), 1u);
  open(bob_);
  look(bob_, 1, ahead_);
  run(10);
  EXPECT_EQ(keys(first_), 2u);
  const auto& frames = heard_.frames[first_];
  ASSERT_GT(frames.size(), before);
  for (std::size_t i = 1; i < frames.size(); ++i) EXPECT_EQ(frames[i].frame, frames[i - 1].frame + 1);
  const auto& key = *std::find_if(frames.begin() + static_cast<std::ptrdiff_t>(before), frames.end(),
                                  [](const auto& f) { return f.key; });
  ASSERT_FALSE(key.answers.empty());
  EXPECT_EQ(key.answers.back().session, bob_) << "what it has no picture for is not answered before";
}

TEST_F(SharedStreams, ManyWhoComeAtOnceShareKeyFrames) {
  open(ann_);
  look(ann_, 1, ahead_);
  run(20);
  for (std::uint64_t i = 2; i <= 21; ++i) {
    open(SessionId{i});
    look(SessionId{i}, 1, ahead_);
    if (i % 4 == 0) run(1);  // 0.5 s for all of them
  }
  run(10);
  EXPECT_LE(keys(first_), 4u);
  EXPECT_EQ(heard_.encoders.size(), 1u);
  EXPECT_EQ(heard_.receivers[first_].size(), 21u);
  for (std::uint64_t i = 2; i <= 21; ++i) EXPECT_EQ(answered(SessionId{i}).size(), 1u) << i;
}

TEST_F(SharedStreams, MembersForceTwoKeyFramesASecondBetweenThem) {
  both_look_ahead();
  const auto before = keys(first_);
  for (int i = 0; i < 20; ++i) {  // 2 s
    scheduler_.tell(KeyFrameWanted(i % 2 == 0 ? ann_ : bob_));
    system_.run_until_idle();
    run(1);
  }
  EXPECT_LE(keys(first_) - before, 5u);
  EXPECT_GE(keys(first_) - before, 3u);
}

TEST_F(SharedStreams, AStreamEndsWithItsLastMemberNotBefore) {
  both_look_ahead();
  scheduler_.tell(SessionClosed(ann_));
  system_.run_until_idle();
  EXPECT_EQ(heard_.receivers[first_], std::vector<SessionId>{bob_});
  EXPECT_EQ(heard_.encoders, std::set<StreamId>{first_});
  look(bob_, 2, aside_);
  run(10);
  EXPECT_TRUE(answered(bob_).contains(2));
  scheduler_.tell(SessionClosed(bob_));
  system_.run_until_idle();
  EXPECT_TRUE(heard_.encoders.empty());
  EXPECT_TRUE(heard_.receivers[first_].empty());
}

TEST_F(SharedStreams, ClientsThatDoNotKeepUpGetAStreamApartAndTheOthersNoneOfTheirKeyFrames) {
  both_look_ahead();
  const auto falls_behind = [&](int updates) {
    scheduler_.tell(KeyFrameWanted(bob_, StreamLayer::kShared, true));
    system_.run_until_idle();
    run(updates);
  };
  falls_behind(30);
  EXPECT_EQ(heard_.encoders.size(), 1u) << "once may happen to anybody";
  falls_behind(10);
  ASSERT_EQ(heard_.encoders.size(), 2u);
  EXPECT_EQ(heard_.receivers[first_], std::vector<SessionId>{ann_});
  const auto before = keys(first_);
  for (int i = 0; i < 5; ++i) falls_behind(10);
  EXPECT_EQ(keys(first_), before);
  open(cid_);
  look(cid_, 1, ahead_);
  run(10);
  EXPECT_EQ(heard_.receivers[first_], (std::vector<SessionId>{ann_, cid_}));
  run(700);
  EXPECT_EQ(heard_.receivers[first_], (std::vector<SessionId>{ann_, bob_, cid_})) << "it has kept up for a minute";
  EXPECT_EQ(heard_.encoders, std::set<StreamId>{first_});
}

TEST_F(SharedStreams, ASlowLinkHasAStreamThatFollowsItAndTheOthersDoNotNotice) {
  both_look_ahead();
  scheduler_.tell(LinkChanged(bob_, LinkState::kFree, 100e3));
  run(15);
  ASSERT_EQ(heard_.receivers[first_], std::vector<SessionId>{ann_});
  ASSERT_EQ(heard_.receivers[second_], std::vector<SessionId>{bob_});
  ASSERT_FALSE(heard_.frames[second_].empty());
  EXPECT_GT(heard_.frames[second_].back().most_bytes, 0u);
  EXPECT_LE(heard_.frames[second_].back().most_bytes, 100'000u);
  scheduler_.tell(LinkChanged(bob_, LinkState::kFull, 100e3));
  system_.run_until_idle();
  const auto frames = heard_.frames[second_].size();
  const auto others = heard_.frames[first_].size();
  look(bob_, 2, ahead_);
  run(10, 2);
  run(10, 3);
  EXPECT_EQ(heard_.frames[second_].size(), frames) << "it would only wait";
  EXPECT_TRUE(answered(bob_).contains(2)) << "a camera does not wait with it";
  EXPECT_GT(heard_.frames[first_].size(), others);
  EXPECT_EQ(heard_.frames[first_].back().most_bytes, 0u);
  scheduler_.tell(LinkChanged(bob_, LinkState::kFree, 100e3));
  system_.run_until_idle();
  EXPECT_EQ(heard_.frames[second_].size(), frames + 1) << "at once";
}

TEST_F(SharedStreams, AFullLinkInAStreamOfManyIsWaitedForByNobody) {
  both_look_ahead();
  scheduler_.tell(LinkChanged(bob_, LinkState::kFull, 1.5e6));
  system_.run_until_idle();
  const auto frames = heard_.frames[first_].size();
  run(5, 2);
  EXPECT_GT(heard_.frames[first_].size(), frames);
  run(20, 3);
  EXPECT_EQ(heard_.receivers[first_], std::vector<SessionId>{ann_}) << "it stands for more than a second";
}

TEST_F(SharedStreams, WhoeverIsAloneHasFramesAsTheLinkHasRoom) {
  open(ann_);
  look(ann_, 1, ahead_);
  run(10);
  scheduler_.tell(LinkChanged(ann_, LinkState::kFull, 50e6));
  system_.run_until_idle();
  const auto frames = heard_.frames[first_].size();
  scheduler_.tell(KeyFrameWanted(ann_));
  run(5, 2);
  EXPECT_EQ(heard_.frames[first_].size(), frames) << "not even a key frame";
  scheduler_.tell(LinkChanged(ann_, LinkState::kFree, 50e6));
  system_.run_until_idle();
  ASSERT_EQ(heard_.frames[first_].size(), frames + 1);
  EXPECT_TRUE(heard_.frames[first_].back().key);
}

TEST_F(SharedStreams, NobodyWaitsForAFrameUnderWayAndAnswersComeInOrder) {
  both_look_ahead();
  look(ann_, 2, aside_);
  for (int i = 0; i < 12 && heard_.frames[first_].back().answers.empty(); ++i) run(1);
  look(bob_, 2, aside_);
  run(30);
  // A frame goes out and stays under way, and bob's camera does not wait for it.
  scheduler_.tell(KeyFrameWanted(ann_));
  system_.run_until_idle();
  const auto frames = heard_.frames[first_].size();
  look(bob_, 3, ahead_);
  for (int i = 0; i < 5; ++i) tick();
  EXPECT_EQ(heard_.frames[first_].size(), frames);
  EXPECT_TRUE(answered(bob_).contains(3));
  CameraSequence last = 0;
  for (const auto& n : heard_.no_changes) {
    if (n.answer.session != bob_) continue;
    EXPECT_GT(n.answer.sequence, last);
    last = n.answer.sequence;
  }
}

// Twenty who walk side by side.
class Crowd : public SharedStreams {
 protected:
  static constexpr std::uint64_t kMany = 20;
  void SetUp() override {
    for (std::uint64_t i = 1; i <= kMany; ++i) {
      open(SessionId{i}, 2048, 0);
      look(SessionId{i}, 1, at(i, 0));
      run(1);
    }
    run(20);
    ASSERT_EQ(heard_.encoders.size(), 1u);
    system_.clear_log();
  }
  static Camera at(std::uint64_t who, int step) {
    const double x = 0.002 * static_cast<double>(who), z = 1.5 - 0.004 * step;
    return look_at({x, 0.4, z}, {-0.6 + x, -0.2, z - 9.5}, 55);
  }
  std::size_t looks() {
    std::size_t n = 0;
    for (const auto& handled : system_.messages_log()) n += handled.message == "ViewTraced" ? 1 : 0;
    return n;
  }
};

TEST_F(Crowd, EachLooksForItselfNowAndThenAndIsAnsweredEachTime) {
  constexpr int kSteps = 30;
  for (int step = 1; step <= kSteps; ++step) {
    for (std::uint64_t i = 1; i <= kMany; ++i) look(SessionId{i}, static_cast<CameraSequence>(step + 1), at(i, step));
    run(1);
  }
  run(3);
  EXPECT_LE(looks(), kMany * kSteps / 2);
  EXPECT_GE(looks(), kMany * kSteps / 10) << "but each does look";
  for (std::uint64_t i = 1; i <= kMany; ++i) EXPECT_TRUE(answered(SessionId{i}).contains(kSteps + 1)) << i;
  std::size_t answers = 0;
  for (std::uint64_t i = 1; i <= kMany; ++i) answers += answered(SessionId{i}).size();
  EXPECT_GE(answers, kMany * kSteps * 9 / 10);
}

TEST_F(Crowd, WhoJumpsElsewhereIsLookedForAtOnce) {
  look(SessionId{7}, 2, at(7, 1));
  run(1);
  const auto before = looks();
  look(SessionId{7}, 3, aside_);
  run(2);
  EXPECT_GT(looks(), before);
  EXPECT_TRUE(answered(SessionId{7}).contains(3));
}

// Two different views do not fit together.
class CrowdedStreams : public SharedStreams {
 protected:
  static constexpr std::uint32_t kSmall = 8 * kSlotSize;
  const Camera corner_ = look_at({3, 0.6, -8}, {3.3, -1, -9}, 70);
  const Camera other_ = look_at({-3, 0.6, 0}, {-3.3, -1, -1}, 70);
};

TEST_F(CrowdedStreams, ViewsThatMoveApartArePartedAndBothGoOn) {
  open(ann_, kSmall);
  open(bob_, kSmall);
  look(ann_, 1, corner_);
  look(bob_, 1, corner_);
  run(10);
  ASSERT_EQ(heard_.encoders.size(), 1u);
  look(bob_, 2, other_);
  run(3);
  EXPECT_EQ(heard_.encoders.size(), 1u) << "not at once";
  run(20);
  ASSERT_EQ(heard_.encoders.size(), 2u);
  EXPECT_EQ(heard_.receivers[first_].size(), 1u);
  EXPECT_EQ(heard_.receivers[second_].size(), 1u);
  ASSERT_FALSE(heard_.frames[second_].empty());
  EXPECT_TRUE(heard_.frames[second_].front().key);
  EXPECT_FALSE(heard_.frames[second_].front().writes.empty()) << "it begins with what there is";
  EXPECT_EQ(keys(second_), 1u);
  EXPECT_EQ(keys(first_), 2u) << "one for the late joiner; who stays needs none";
  look(ann_, 2, corner_);
  look(bob_, 3, other_);
  run(3);
  EXPECT_TRUE(answered(ann_).contains(2));
  EXPECT_TRUE(answered(bob_).contains(2));
  EXPECT_TRUE(answered(bob_).contains(3));
  look(bob_, 4, corner_);
  run(60);
  EXPECT_EQ(heard_.encoders.size(), 1u) << "together again";
  EXPECT_TRUE(answered(bob_).contains(4));
}

TEST_F(CrowdedStreams, WhatDoesNotFitIsSharedOutAndAnsweredMeanwhile) {
  open(ann_, kSmall);
  open(bob_, kSmall);
  look(ann_, 1, ahead_);
  look(bob_, 1, ahead_);
  run(10);
  for (CameraSequence s = 2; s < 10; ++s) {
    look(bob_, s, s % 2 == 0 ? aside_ : ahead_);
    run(2);
  }
  const auto answers = answered(bob_);
  for (CameraSequence s = 2; s < 10; ++s) EXPECT_TRUE(answers.contains(s)) << s;
}

TEST_F(SharedStreams, AnEncoderThatIsGoneIsReplacedAndAllGetAKeyFrame) {
  both_look_ahead();
  scheduler_.tell(KeyFrameWanted(bob_));
  system_.run_until_idle();
  const auto before = keys(first_);
  system_.stop(encoders_.at(first_));
  system_.run_until_idle();
  for (int i = 0; i < 30; ++i) tick();  // nobody reports the frame that was under way
  ASSERT_EQ(keys(first_), before + 1);
  EXPECT_EQ(heard_.receivers[first_].size(), 2u);
}

}  // namespace
}  // namespace darm::tile_scheduler
