#include "actors/tile_scheduler/tile_scheduler_actor.hpp"

#include <gtest/gtest.h>

#include "tests/actor/tile_scheduler/scheduler_and_neighbours.hpp"

namespace darm::tile_scheduler {
namespace {

TEST_F(TileScheduler, AnswersACameraWithWorkForTheRendererAndAKeyFrame) {
  open(ann_);
  tick();
  EXPECT_TRUE(heard_.frames[first_].empty()) << "no camera, no frame";
  look(ann_, 1, ahead_);
  EXPECT_EQ(heard_.receivers[first_], std::vector<SessionId>{ann_});
  ASSERT_FALSE(heard_.work.empty());
  EXPECT_FALSE(heard_.work.back().work->empty());
  ASSERT_EQ(heard_.frames[first_].size(), 1u);
  const auto& frame = heard_.frames[first_].back();
  EXPECT_TRUE(frame.key);
  ASSERT_EQ(frame.answers.size(), 1u);
  EXPECT_EQ(frame.answers[0].sequence, 1u);
  EXPECT_EQ(frame.answers[0].session, ann_);
}

class PatientTileScheduler : public TileScheduler {
 protected:
  PatientTileScheduler() : TileScheduler(SchedulerOptions().first_frame_wait) {}
};

TEST_F(PatientTileScheduler, TheFirstFrameHoldsThePicturesThatCameSoon) {
  open(ann_);
  look(ann_, 1, ahead_);
  EXPECT_TRUE(heard_.frames[first_].empty());
  shade_all(1);
  tick();
  ASSERT_EQ(heard_.frames[first_].size(), 1u);
  EXPECT_TRUE(heard_.frames[first_].back().key);
  EXPECT_FALSE(heard_.frames[first_].back().writes.empty());
}

TEST_F(PatientTileScheduler, TheFirstFrameDoesNotWaitLongForPictures) {
  open(ann_);
  look(ann_, 1, ahead_);
  for (int i = 0; i < 4; ++i) tick();
  ASSERT_EQ(heard_.frames[first_].size(), 1u);
  EXPECT_EQ(heard_.frames[first_].back().answers.size(), 1u);
}

TEST_F(TileScheduler, WhoHasNothingYetIsToldAtOnceHowFarTheCoarsePictureIsOff) {
  open(ann_);
  open(SessionId{2});  // has sent no camera: there is no view to tell of
  look(ann_, 1, ahead_);
  const float unlit = heard_.frames[first_].back().errors.at(0).error;
  const auto told_before = heard_.no_changes.size();
  auto coarse = std::make_shared<CoarseLuma>();
  scheduler_.tell(CoarsePictured(coarse));
  system_.run_until_idle();
  EXPECT_EQ(heard_.no_changes.size(), told_before) << "the frame under way would be read after it";
  finish_frame(first_);
  ASSERT_EQ(heard_.no_changes.size(), told_before + 1);
  const auto& told = heard_.no_changes.back();
  EXPECT_EQ(told.answer.session, ann_);
  EXPECT_EQ(told.answer.sequence, 0u) << "it answers no camera";
  EXPECT_LT(told.error, unlit);
  scheduler_.tell(CoarsePictured(coarse));
  system_.run_until_idle();
  EXPECT_EQ(heard_.no_changes.size(), told_before + 1) << "later ones come with frames";
}

TEST_F(TileScheduler, SendsTilesOnceTheyHavePictures) {
  open(ann_);
  look(ann_, 1, ahead_);
  finish_frame(first_);
  shade_all(1);
  tick();
  ASSERT_GE(heard_.frames[first_].size(), 2u);
  const auto& frame = heard_.frames[first_].back();
  EXPECT_FALSE(frame.key);
  EXPECT_FALSE(frame.writes.empty());
  EXPECT_EQ(frame.writes.size(), frame.edits.size());
  EXPECT_LT(frame.error, 0.05f);
}

TEST_F(TileScheduler, KeepsOneFrameInFlight) {
  open(ann_);
  look(ann_, 1, ahead_);
  shade_all(1);
  tick();
  tick();
  EXPECT_EQ(heard_.frames[first_].size(), 1u);
  finish_frame(first_);
  tick();
  EXPECT_EQ(heard_.frames[first_].size(), 2u);
}

TEST_F(TileScheduler, StopsTracingAndSendsNothingWhenAStillViewIsKnown) {
  open(ann_);
  look(ann_, 1, ahead_);
  for (int i = 0; i < 90; ++i) {
    shade_all(1);
    finish_frame(first_);
    tick();
  }
  const auto frames = heard_.frames[first_].size();
  const auto work = heard_.work.size();
  system_.clear_log();
  for (int i = 0; i < 10; ++i) tick();
  EXPECT_EQ(heard_.frames[first_].size(), frames);
  EXPECT_EQ(heard_.work.size(), work);
  for (const auto& handled : system_.messages_log()) EXPECT_EQ(handled.message, "Tick");
  look(ann_, 2, ahead_);
  ASSERT_EQ(heard_.no_changes.size(), 1u);
  EXPECT_EQ(heard_.no_changes[0].answer.sequence, 2u);
  shade_all(2);
  tick();
  EXPECT_EQ(heard_.frames[first_].size(), frames + 1) << "refinements still make frames";
  EXPECT_TRUE(heard_.frames[first_].back().edits.empty());
}

TEST_F(TileScheduler, LooksCloserLessOftenWhilePicturesAreMissing) {
  open(ann_);
  look(ann_, 1, ahead_);
  const auto traces_in = [&](int ticks, bool lit) {
    int traces = 0;
    system_.clear_log();
    for (int i = 0; i < ticks; ++i) {
      if (lit) shade_all(1);
      tick();
    }
    for (const auto& handled : system_.messages_log()) traces += handled.message == "ViewTraced" ? 1 : 0;
    return traces;
  };
  EXPECT_EQ(traces_in(1, false), 1) << "the first two passes come at once";
  EXPECT_EQ(traces_in(12, false), 3);
  EXPECT_GE(traces_in(12, true), 10);
}

TEST_F(TileScheduler, WeighsACrowdedStillViewAnewByItsPictures) {
  open(ann_, 2 * kSlotSize);  // four slots
  look(ann_, 1, ahead_);
  for (int i = 0; i < 90; ++i) {
    shade_all(1);
    finish_frame(first_);
    tick();
  }
  const auto work = heard_.work.size();
  for (int i = 0; i < 20; ++i) tick();
  EXPECT_EQ(heard_.work.size(), work) << "no new pictures, no new weights";
  shade_all(2);
  for (int i = 0; i < 20; ++i) tick();
  EXPECT_EQ(heard_.work.size(), work + 1);
}

TEST_F(TileScheduler, AnswersEveryCameraOfAMovingView) {
  open(ann_);
  std::set<CameraSequence> answered;
  std::size_t taken = 0;
  for (CameraSequence s = 1; s <= 12; ++s) {
    look(ann_, s, look_at({0.3 + 0.1 * double(s), 0.4, 1.5}, {-0.6, -0.2, -8}, 55));
    shade_all(static_cast<std::uint32_t>(s));
    tick();
    auto& frames = heard_.frames[first_];
    for (; taken < frames.size(); ++taken)
      for (const auto& a : frames[taken].answers) answered.insert(a.sequence);
    finish_frame(first_);
  }
  for (const auto& n : heard_.no_changes) answered.insert(n.answer.sequence);
  for (const auto& a : heard_.frames[first_].back().answers) answered.insert(a.sequence);
  for (CameraSequence s = 1; s <= 11; ++s) EXPECT_TRUE(answered.contains(s)) << s;
}

TEST_F(TileScheduler, AKeyFrameHoldsTheWholeTable) {
  open(ann_);
  look(ann_, 1, ahead_);
  finish_frame(first_);
  shade_all(1);
  tick();
  const auto resident = heard_.frames[first_].back().edits.size();
  finish_frame(first_);
  scheduler_.tell(KeyFrameWanted(ann_));
  system_.run_until_idle();
  const auto& key = heard_.frames[first_].back();
  EXPECT_TRUE(key.key);
  EXPECT_GE(key.edits.size(), resident);
  EXPECT_EQ(key.writes.size(), key.edits.size());
}

TEST_F(TileScheduler, AClientMayForceTwoKeyFramesASecond) {
  open(ann_);
  look(ann_, 1, ahead_);
  finish_frame(first_);
  tick();
  const auto keys_in = [&](int requests) {
    std::size_t keys = 0;
    for (int i = 0; i < requests; ++i) {
      const auto before = heard_.frames[first_].size();
      scheduler_.tell(KeyFrameWanted(ann_));
      system_.advance(10ms);
      if (heard_.frames[first_].size() == before) continue;
      keys += heard_.frames[first_].back().key ? 1 : 0;
      finish_frame(first_);
    }
    return keys;
  };
  EXPECT_EQ(keys_in(30), 1u) << "0.3 s";
  const auto keys = keys_in(300);
  EXPECT_GE(keys, 5u) << "3 s: put off, not refused";
  EXPECT_LE(keys, 7u);
}

TEST_F(TileScheduler, JoinsTheWorkOfAllSessionsAndForgetsAClosedOne) {
  const SessionId bob{2};
  open(ann_);
  open(bob);
  look(ann_, 1, ahead_);
  const auto anns = heard_.work.back().work->size();
  look(bob, 1, aside_);
  EXPECT_GT(heard_.work.back().work->size(), anns);
  scheduler_.tell(SessionClosed(bob));
  system_.run_until_idle();
  EXPECT_EQ(heard_.work.back().work->size(), anns);
  EXPECT_EQ(heard_.encoders, std::set<StreamId>{first_});
  EXPECT_EQ(heard_.receivers[first_], std::vector<SessionId>{ann_});
}

TEST_F(TileScheduler, SharedTilesAreAsExactAsTheMostExactingSessionAsks) {
  target_error_ = 0.01f;
  open(ann_);
  look(ann_, 1, ahead_);
  for (const auto& request : *heard_.work.back().work) ASSERT_EQ(request.target_error, 0.01f);
  target_error_ = 0.001f;
  const SessionId bob{2};
  open(bob);
  look(bob, 1, ahead_);
  for (const auto& request : *heard_.work.back().work) EXPECT_EQ(request.target_error, 0.001f);
  scheduler_.tell(SessionClosed(bob));
  system_.run_until_idle();
  for (const auto& request : *heard_.work.back().work) EXPECT_EQ(request.target_error, 0.01f);
}

TEST_F(TileScheduler, ASessionThatClosesWhileItsViewIsTracedLeavesNothingBehind) {
  open(ann_);
  scheduler_.tell(ViewChanged(ann_, 1, ahead_, Viewport{160, 90}, FrameStamps{}));
  scheduler_.tell(SessionClosed(ann_));
  system_.run_until_idle();
  for (int i = 0; i < 5; ++i) tick();
  EXPECT_TRUE(heard_.frames[first_].empty());
  EXPECT_TRUE(heard_.encoders.empty());
  ASSERT_FALSE(heard_.work.empty());
  EXPECT_TRUE(heard_.work.back().work->empty());
  look(ann_, 2, ahead_);
  EXPECT_TRUE(heard_.frames[first_].empty());
}

TEST_F(TileScheduler, ASmallViewNeedNotWaitForTheLargestThereIs) {
  const SessionId bob{2};
  open(ann_);
  open(bob, 2048);
  scheduler_.tell(ViewChanged(ann_, 1, ahead_, Viewport{16384, 16384}, FrameStamps{}));
  scheduler_.tell(ViewChanged(bob, 1, aside_, Viewport{160, 90}, FrameStamps{}));
  system_.run_until_idle();
  EXPECT_EQ(heard_.order, (std::vector<StreamId>{first_, StreamId{2}}));
  EXPECT_EQ(heard_.receivers[first_], std::vector<SessionId>{bob}) << "slices take turns";
}

TEST_F(TileScheduler, WhatAClosedSessionWouldHaveSeenIsTracedNoFurther) {
  open(ann_);
  const Viewport largest{16384, 16384};
  scheduler_.tell(ViewChanged(ann_, 1, ahead_, largest, FrameStamps{}));
  const auto all = system_.run_until_idle();
  system_.advance(1s);
  scheduler_.tell(ViewChanged(ann_, 2, aside_, largest, FrameStamps{}));
  scheduler_.tell(SessionClosed(ann_));
  EXPECT_LT(system_.run_until_idle(), all / 4);
}

TEST_F(TileScheduler, AFailedFrameIsFollowedByAKeyFrame) {
  open(ann_);
  look(ann_, 1, ahead_);
  finish_frame(first_, false);
  ASSERT_EQ(heard_.frames[first_].size(), 2u);
  EXPECT_TRUE(heard_.frames[first_].back().key);
  EXPECT_EQ(heard_.frames[first_].back().answers.size(), 1u);
}

// Everything in the room reflects.

}  // namespace
}  // namespace darm::tile_scheduler
