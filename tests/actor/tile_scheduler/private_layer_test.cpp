// The private layer of a session, as the tile scheduler runs it.
#include <gtest/gtest.h>

#include "actors/tile_scheduler/tile_scheduler_actor.hpp"
#include "tests/actor/tile_scheduler/scheduler_and_neighbours.hpp"

namespace darm::tile_scheduler {
namespace {

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
