#include "daemon/accuracy/software_view.hpp"

#include <gtest/gtest.h>

#include "actors/atlas/build_layout.hpp"
#include "tests/unit/scene/small_glb.hpp"

namespace darm::accuracy {
namespace {

constexpr Viewport kPicture{320, 180};  // fine enough for the level that the wall has

// A wall of one triangle, 4 m wide, in the plane z = 0.
class Wall : public ::testing::Test {
 protected:
  void SetUp() override {
    scene::test::SmallScene wall;
    wall.positions = {-2, -2, 0, 2, -2, 0, 0, 2, 0};
    auto loaded = scene::test::load(wall);
    ASSERT_TRUE(loaded) << loaded.error().message;
    atlas::LayoutOptions options;
    options.q = 64;
    options.threads = 1;
    auto layout = atlas::build_layout(**loaded, options);
    ASSERT_TRUE(layout) << layout.error().message;
    layout_ = std::move(*layout);
    auto rays = renderer::trace::RayScene::build(*loaded, 1);
    ASSERT_TRUE(rays) << rays.error().message;
    rays_ = std::move(*rays);
  }
  [[nodiscard]] SoftwareView view_towards(double z) const {
    return {*layout_, *rays_, look_at({0, 0, 3}, {0, 0, z}, 40), kPicture, 1};
  }
  std::shared_ptr<const atlas::Layout> layout_;
  std::shared_ptr<const renderer::trace::RayScene> rays_;
};

// A frame that brings the tiles of all levels with whose number `chosen` agrees.
template <class Chosen>
void show_tiles(const atlas::Layout& layout, const Chosen& chosen, ClientState& state) {
  std::vector<encoder::PageEdit> edits;
  std::vector<encoder::SlotWrite> writes;
  for (int level = 0; level < static_cast<int>(layout.levels.size()); ++level) {
    const auto& l = layout.levels[static_cast<std::size_t>(level)];
    for (std::uint32_t i = 0; i < l.tiles_x * l.tiles_y; ++i) {
      if (!chosen(i)) continue;
      const auto slot = static_cast<SlotIndex>(edits.size());
      edits.push_back({TileId(level, i), slot, nullptr, nullptr});
      writes.push_back({slot, std::make_shared<TileImage>()});
    }
  }
  state.apply(true, edits, writes);
}

TEST_F(Wall, ItIsKnownHowMuchOfTheViewIsTiles) {
  const auto view = view_towards(0);
  ClientState state(*layout_, 2048);
  EXPECT_EQ(view.share_of_tiles(state, 2), 0);
  show_tiles(*layout_, [](std::uint32_t) { return true; }, state);
  EXPECT_EQ(view.share_of_tiles(state, 2), 1);
  show_tiles(*layout_, [](std::uint32_t i) { return i % 2 == 0; }, state);
  EXPECT_GT(view.share_of_tiles(state, 2), 0.1);
  EXPECT_LT(view.share_of_tiles(state, 2), 0.9);
}

TEST_F(Wall, WhoLooksAwaySeesNothingThatCounts) {
  EXPECT_GT(counted_share(view_towards(0).counted()), 0.3);
  const auto away = view_towards(6);
  EXPECT_EQ(counted_share(away.counted()), 0);
  EXPECT_EQ(away.share_of_tiles(ClientState(*layout_, 2048), 1), 0);
}

}  // namespace
}  // namespace darm::accuracy
