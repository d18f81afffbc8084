// Private tiles of several sessions: each for its own eye, and none touched by another's.
#include "actors/renderer/view_renderer_actor.hpp"

#include <gtest/gtest.h>

#include <map>

#include "actors/renderer/display_curve.hpp"
#include "actors/renderer/stored_light.hpp"
#include "actors/runtime/deterministic_system.hpp"
#include "tests/actor/renderer/counting_metrics.hpp"
#include "tests/unit/renderer_tile/made_up_view.hpp"

namespace darm::renderer {
namespace {

using Pictures = std::map<SessionId, std::vector<tile_scheduler::ShadedTile>>;

// Stands in for the tile scheduler: keeps what it is told.
class Listener : public runtime::Actor<tile_scheduler::Inbox> {
 public:
  Listener(runtime::Context<tile_scheduler::Inbox> context, Pictures* heard)
      : Actor(std::move(context)), heard_(heard) {}
  void on(tile_scheduler::ViewTilesShaded&& m) {
    for (auto& t : m.tiles) (*heard_)[m.session].push_back(std::move(t));
  }
  template <class M>
  void on(M&&) {}

 private:
  Pictures* heard_;
};

class ViewRendererActorTest : public ::testing::Test {
 protected:
  void SetUp() override {
    slots = std::make_shared<MadeUpSlots>();
    // A tile shows where its eye is.
    slots->world.light = [](TileId, int, const glm::vec3& eye, std::uint32_t) {
      ViewDependentLight l;
      l.radiance = eye;
      l.ggx_alpha = 0.001f;
      l.distance = 1;
      return l;
    };
    ViewRendererParts parts;
    parts.surfaces = slots;
    parts.options = options;
    parts.scheduler = system.spawn<Listener>("tile_scheduler", 64, &heard);
    parts.metrics = &metrics;
    parts.options.tile.max_samples = 8;
    parts.options.max_tiles = 20;
    renderer = system.spawn<ViewRendererActor>("view_renderer", 64, parts);
    system.run_until_idle();
  }
  void look(SessionId session, const glm::vec3& eye, std::uint32_t tiles = 2) {
    auto work = std::make_shared<std::vector<ViewTileRequest>>();
    for (std::uint32_t i = 0; i < tiles; ++i) work->push_back({TileId(0, i), 0.1f, whole_slot()});
    renderer.tell(ShadeView(session, eye, 0.002f, std::move(work)));
    system.run_until_idle();
  }
  glm::ivec3 shown(SessionId session, std::uint32_t tile) {
    for (auto it = heard[session].rbegin(); it != heard[session].rend(); ++it)
      if (it->tile == TileId(0, tile)) return {it->image->rgb[99], it->image->rgb[100], it->image->rgb[101]};
    return {-1, -1, -1};
  }
  static glm::ivec3 codes(const glm::vec3& l) { return {srgb_code(l.x), srgb_code(l.y), srgb_code(l.z)}; }

  const SessionId ann{1}, bob{2};
  std::shared_ptr<MadeUpSlots> slots;
  ViewRendererOptions options;
  Pictures heard;
  CountingMetrics metrics;
  runtime::DeterministicSystem system{2};
  runtime::Ref<ViewInbox> renderer;
};

TEST_F(ViewRendererActorTest, two_eyes_get_tiles_of_their_own_and_moving_one_leaves_the_other_alone) {
  const glm::vec3 here(0.2f, 0.5f, 0.1f), there(0.7f, 0.1f, 0.3f), elsewhere(0.9f, 0.9f, 0.1f);
  look(ann, here);
  look(bob, there);
  for (const std::uint32_t tile : {0u, 1u}) {
    EXPECT_EQ(shown(ann, tile), codes(here));
    EXPECT_EQ(shown(bob, tile), codes(there));
  }
  const auto before = heard[ann].size();
  look(bob, elsewhere);
  EXPECT_EQ(shown(bob, 0), codes(elsewhere));
  EXPECT_EQ(heard[ann].size(), before) << "what the other has is as it was";
  EXPECT_EQ(shown(ann, 0), codes(here));
}

TEST_F(ViewRendererActorTest, work_ends_with_the_samples_and_a_session_that_leaves_is_forgotten) {
  look(ann, {0.5f, 0.5f, 0.5f});
  EXPECT_EQ(metrics.counts["darm_view_samples_total"], 2.0 * kSlotTexels * 8);
  renderer.tell(ShadeView(ann, {}, 0.0f, nullptr));
  system.run_until_idle();
  look(ann, {0.5f, 0.5f, 0.5f});
  EXPECT_EQ(metrics.counts["darm_view_samples_total"], 4.0 * kSlotTexels * 8) << "begun anew";
}

TEST_F(ViewRendererActorTest, paths_end_in_the_newest_stored_light) {
  look(ann, {0.5f, 0.5f, 0.5f});
  EXPECT_EQ(slots->stored, nullptr);
  auto layout = std::make_shared<atlas::Layout>();
  layout->levels.emplace_back().density = 1;
  const auto light = std::make_shared<const StoredLight>(layout);
  renderer.tell(LightStored(light));
  look(ann, {0.9f, 0.5f, 0.5f});
  EXPECT_EQ(slots->stored, light);
}

TEST_F(ViewRendererActorTest, without_sessions_nothing_is_done_at_all) {
  system.advance(std::chrono::seconds(5));
  EXPECT_TRUE(metrics.counts.empty());
}

TEST_F(ViewRendererActorTest, tiles_are_bounded_over_all_sessions) {
  look(ann, {0.5f, 0.5f, 0.5f}, 15);
  look(bob, {0.5f, 0.5f, 0.5f}, 15);
  EXPECT_EQ(metrics.counts["darm_view_tiles_refused_total"], 10.0);
  EXPECT_EQ(shown(bob, 4), codes(glm::vec3(0.5f)));
  EXPECT_EQ(shown(bob, 5), glm::ivec3(-1));
}

TEST_F(ViewRendererActorTest, a_tile_that_fails_is_given_up_and_counted) {
  slots->world.light = [](TileId tile, int, const glm::vec3&, std::uint32_t) -> ViewDependentLight {
    if (tile == TileId(0, 1)) throw std::runtime_error("no");
    ViewDependentLight l;
    l.radiance = glm::vec3(0.5f);
    return l;
  };
  look(ann, {0.5f, 0.5f, 0.5f});
  EXPECT_EQ(metrics.counts["darm_view_failed_tiles_total"], 1.0);
  EXPECT_EQ(shown(ann, 0), codes(glm::vec3(0.5f)));
}

}  // namespace
}  // namespace darm::renderer
