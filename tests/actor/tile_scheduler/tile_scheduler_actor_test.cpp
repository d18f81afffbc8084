#include "actors/tile_scheduler/tile_scheduler_actor.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "actors/runtime/deterministic_system.hpp"
#include "tests/unit/tile_scheduler/quad_scene.hpp"

namespace darm::tile_scheduler {
namespace {

using namespace std::chrono_literals;

// What the neighbours heard; outlives the actors.
struct Heard {
  std::vector<renderer::ShadeTiles> work;
  std::map<StreamId, std::vector<encoder::ComposeFrame>> frames;
  std::vector<StreamId> order;  // of all frames
  std::vector<session::NoChange> no_changes;
  std::map<StreamId, std::vector<SessionId>> receivers;
  std::set<StreamId> encoders;
  std::vector<renderer::ShadeView> views;
};

class FakeViewRenderer : public runtime::Actor<renderer::ViewInbox> {
 public:
  FakeViewRenderer(runtime::Context<renderer::ViewInbox> context, Heard* heard)
      : Actor(std::move(context)), heard_(heard) {}
  void on(renderer::ShadeView&& m) { heard_->views.push_back(m); }
  void on(renderer::LightStored&&) {}
  void on(renderer::ViewSliceFinished&&) {}

 private:
  Heard* heard_;
};

class FakeRenderer : public runtime::Actor<renderer::Inbox> {
 public:
  FakeRenderer(runtime::Context<renderer::Inbox> context, Heard* heard) : Actor(std::move(context)), heard_(heard) {}
  void on(renderer::ShadeTiles&& m) { heard_->work.push_back(m); }
  void on(renderer::SliceFinished&&) {}

 private:
  Heard* heard_;
};

class FakeEncoder : public runtime::Actor<encoder::Inbox> {
 public:
  FakeEncoder(runtime::Context<encoder::Inbox> context, Heard* heard, StreamId stream)
      : Actor(std::move(context)), heard_(heard), stream_(stream) {}
  void on(encoder::ComposeFrame&& m) {
    heard_->order.push_back(stream_);
    heard_->frames[stream_].push_back(std::move(m));
  }
  void on(encoder::PictureEncoded&&) {}

 private:
  Heard* heard_;
  StreamId stream_;
};

class FakeSession : public runtime::Actor<session::Inbox> {
 public:
  FakeSession(runtime::Context<session::Inbox> context, Heard* heard) : Actor(std::move(context)), heard_(heard) {}
  void on(session::NoChange&& m) { heard_->no_changes.push_back(m); }
  template <class M>
  void on(M&&) {}

 private:
  Heard* heard_;
};

class TileScheduler : public ::testing::Test {
 protected:
  explicit TileScheduler(Microseconds first_frame_wait = 0, float view_weight = 0)
      : world_(testing::make_room()), peers_(std::make_shared<Peers>()) {
    renderer_ = system_.spawn<FakeRenderer>("renderer", 16, &heard_);
    peers_->renderer = [this] { return renderer_; };
    peers_->make_encoder = [this](StreamId id, const StreamFormat&) {
      heard_.encoders.insert(id);
      return system_.spawn<FakeEncoder>("encoder/" + std::to_string(static_cast<unsigned>(id)), 16, &heard_, id);
    };
    peers_->destroy_encoder = [this](StreamId id, const runtime::Ref<encoder::Inbox>& encoder) {
      heard_.encoders.erase(id);
      system_.stop(encoder);
    };
    peers_->set_receivers = [this](StreamId id, std::vector<SessionId> who) { heard_.receivers[id] = std::move(who); };
    peers_->sessions = std::make_shared<runtime::Registry<SessionId, session::Inbox>>();
    std::shared_ptr<const Peers> peers = peers_;
    SchedulerOptions options;
    options.first_frame_wait = first_frame_wait;
    view_renderer_ = system_.spawn<FakeViewRenderer>("view_renderer", 16, &heard_);
    peers_->view_renderer = [this] { return view_renderer_; };
    const auto materials = std::make_shared<std::vector<scene::ViewMaterial>>(world_.scene->instances.size());
    for (auto& m : *materials) m.weight = view_weight;
    scheduler_ = system_.spawn<TileSchedulerActor>("tile_scheduler", 256, world_.layout, world_.rays, peers, options,
                                                   runtime::null_metrics(), materials);
    system_.run_until_idle();
  }

  void open(SessionId id, std::uint32_t phystex_size = 1024, std::uint32_t view_phystex = 512) {
    peers_->sessions->add(
        id, system_.spawn<FakeSession>("session/" + std::to_string(static_cast<unsigned>(id)), 16, &heard_));
    StreamFormat format;
    format.phystex_size = phystex_size;
    format.view_phystex = view_phystex;
    scheduler_.tell(SessionOpened(id, format));
    system_.run_until_idle();
  }
  void look(SessionId id, CameraSequence sequence, const Camera& camera) {
    scheduler_.tell(ViewChanged(id, sequence, camera, Viewport{160, 90}, FrameStamps{}));
    system_.run_until_idle();
  }
  // The renderer has shaded everything it was last asked to display.
  void shade_all(std::uint32_t version) {
    std::vector<ShadedTile> tiles;
    for (const auto& request : *heard_.work.back().work) {
      if (!request.display) continue;
      ShadedTile tile;
      tile.tile = request.tile;
      tile.version = version;
      tile.error = 0.02f;
      tile.image = std::make_shared<TileImage>();
      tiles.push_back(tile);
    }
    scheduler_.tell(TilesShaded(std::move(tiles)));
    system_.run_until_idle();
  }
  // The encoder has finished its newest frame.
  void finish_frame(StreamId stream, bool ok = true) {
    scheduler_.tell(FrameDone(stream, heard_.frames[stream].back().frame, ok));
    system_.run_until_idle();
  }
  void tick() { system_.advance(100ms); }

  const Camera ahead_ = look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55);
  const Camera aside_ = look_at({0.3, 0.4, 1.5}, {-4, 0, -2}, 55);
  const SessionId ann_{1};
  const StreamId first_{1};
  Heard heard_;
  testing::TestWorld world_;
  std::shared_ptr<Peers> peers_;
  runtime::DeterministicSystem system_;
  runtime::Ref<renderer::Inbox> renderer_;
  runtime::Ref<renderer::ViewInbox> view_renderer_;
  runtime::Ref<tile_scheduler::Inbox> scheduler_;
};

TEST_F(TileScheduler, AnswersACameraWithWorkForTheRendererAndAKeyFrame) {
  open(ann_);
  EXPECT_EQ(heard_.receivers[first_], std::vector<SessionId>{ann_});
  tick();
  EXPECT_TRUE(heard_.frames[first_].empty()) << "no camera, no frame";
  look(ann_, 1, ahead_);
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
  EXPECT_EQ(traces_in(3, false), 3) << "the first four passes come at once";
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
  EXPECT_TRUE(heard_.receivers[StreamId{2}].empty());
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
  open(bob);
  scheduler_.tell(ViewChanged(ann_, 1, ahead_, Viewport{16384, 16384}, FrameStamps{}));
  scheduler_.tell(ViewChanged(bob, 1, aside_, Viewport{160, 90}, FrameStamps{}));
  system_.run_until_idle();
  EXPECT_EQ(heard_.order, (std::vector<StreamId>{StreamId{2}, first_})) << "slices take turns";
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
class PrivateLayers : public TileScheduler {
 protected:
  PrivateLayers() : TileScheduler(0, 0.5f) {
    scheduler_.tell(CoarsePictured(std::make_shared<CoarseLuma>()));
    system_.run_until_idle();
  }
  // The view renderer has shaded everything the session was last promised.
  void shade_view(SessionId id, std::uint32_t version) {
    std::vector<ShadedTile> tiles;
    for (auto it = heard_.views.rbegin(); it != heard_.views.rend(); ++it) {
      if (it->session != id) continue;
      for (const auto& request : *it->work) {
        ShadedTile tile;
        tile.tile = request.tile;
        tile.version = version;
        tile.image = std::make_shared<TileImage>();
        tiles.push_back(tile);
      }
      break;
    }
    scheduler_.tell(ViewTilesShaded(id, std::move(tiles)));
    system_.run_until_idle();
  }
  std::size_t views_of(SessionId id) {
    return static_cast<std::size_t>(
        std::count_if(heard_.views.begin(), heard_.views.end(), [&](const auto& v) { return v.session == id; }));
  }
  const SessionId bob_{2};
  const StreamId own_{2};  // ann's private stream
};

class PrivateLayersBeforeLight : public TileScheduler {
 protected:
  PrivateLayersBeforeLight() : TileScheduler(0, 0.5f) {}
};

TEST_F(PrivateLayersBeforeLight, WaitForCoarseTexWithoutWhichThereIsNoPictureAtAll) {
  open(ann_);
  look(ann_, 1, ahead_);
  for (int i = 0; i < 80; ++i) tick();
  EXPECT_TRUE(heard_.views.empty());
  scheduler_.tell(CoarsePictured(std::make_shared<CoarseLuma>()));
  system_.run_until_idle();
  ASSERT_EQ(heard_.views.size(), 1u) << "also for a view that rests";
  EXPECT_FALSE(heard_.views[0].work->empty());
}

TEST_F(TileScheduler, RunsNoPrivateLayerWhereNothingDependsOnTheEye) {
  open(ann_);
  look(ann_, 1, ahead_);
  for (int i = 0; i < 20; ++i) tick();
  EXPECT_TRUE(heard_.views.empty());
  EXPECT_EQ(heard_.encoders.size(), 1u);
}

TEST_F(PrivateLayers, AClientThatTakesNoneHasNone) {
  open(ann_, 1024, 0);
  look(ann_, 1, ahead_);
  tick();
  EXPECT_TRUE(heard_.views.empty());
}

TEST_F(PrivateLayers, TheEyeGoesToTheViewRendererAndItsTilesComeBackOnAStreamOfTheirOwn) {
  open(ann_);
  look(ann_, 1, ahead_);
  ASSERT_FALSE(heard_.views.empty());
  const auto& view = heard_.views.back();
  EXPECT_EQ(view.session, ann_);
  EXPECT_NEAR(view.eye.x, 0.3f, 1e-5f);
  ASSERT_FALSE(view.work->empty());
  EXPECT_LE(view.work->size(), 256u);
  float share = 0;
  for (const auto& request : *view.work) {
    EXPECT_GT(request.mask.count(), 0);
    share += request.share;
  }
  EXPECT_GT(share, 0.6f) << "all of the room; the rest is sky";
  EXPECT_LE(share, 1.0f);
  EXPECT_TRUE(heard_.frames[own_].empty()) << "no pictures, no encoder";
  EXPECT_EQ(heard_.receivers[own_], std::vector<SessionId>{ann_});
  shade_view(ann_, 1);
  ASSERT_EQ(heard_.frames[own_].size(), 1u);
  EXPECT_TRUE(heard_.frames[own_].back().key);
  EXPECT_TRUE(heard_.frames[own_].back().answers.empty());
  EXPECT_FALSE(heard_.frames[own_].back().writes.empty());
  EXPECT_TRUE(heard_.encoders.contains(own_));
}

TEST_F(PrivateLayers, TwoEyesHaveTilesOfTheirOwnAndMovingOneLeavesTheOtherAlone) {
  open(ann_);
  open(bob_);
  look(ann_, 1, ahead_);
  look(bob_, 1, aside_);
  for (int i = 0; i < 400; ++i) tick();  // all passes: both views rest
  shade_view(ann_, 1);
  finish_frame(own_);
  const auto views = views_of(ann_);
  const auto frames = heard_.frames[own_].size();
  look(bob_, 2, look_at({0.1, 0.2, 1.0}, {-0.6, -0.2, -8}, 55));
  for (int i = 0; i < 5; ++i) tick();
  shade_view(bob_, 2);
  EXPECT_EQ(views_of(ann_), views);
  EXPECT_EQ(heard_.frames[own_].size(), frames);
  EXPECT_GT(views_of(bob_), 1u);
}

TEST_F(PrivateLayers, ALostPrivateFrameIsMadeGoodByAKeyFrameOfThatLayerAlone) {
  open(ann_);
  look(ann_, 1, ahead_);
  shade_all(1);
  tick();
  shade_view(ann_, 1);
  finish_frame(own_);
  const auto shared = heard_.frames[first_].size();
  scheduler_.tell(KeyFrameWanted(ann_, StreamLayer::kView));
  system_.run_until_idle();
  ASSERT_EQ(heard_.frames[own_].size(), 2u);
  EXPECT_TRUE(heard_.frames[own_].back().key);
  EXPECT_EQ(heard_.frames[own_].back().edits.size(), heard_.frames[own_].back().writes.size());
  EXPECT_EQ(heard_.frames[first_].size(), shared);
  finish_frame(own_, false);
  tick();
  EXPECT_TRUE(heard_.frames[own_].back().key) << "a failed frame is followed by a key frame";
}

TEST_F(PrivateLayers, ASessionThatEndsTakesItsLayerWithIt) {
  open(ann_);
  look(ann_, 1, ahead_);
  shade_view(ann_, 1);
  scheduler_.tell(SessionClosed(ann_));
  system_.run_until_idle();
  EXPECT_TRUE(heard_.encoders.empty());
  EXPECT_TRUE(heard_.receivers[own_].empty());
  EXPECT_EQ(heard_.views.back().work, nullptr);
  scheduler_.tell(ViewTilesShaded(ann_, {}));
  system_.run_until_idle();
}

}  // namespace
}  // namespace darm::tile_scheduler
