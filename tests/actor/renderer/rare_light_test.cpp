// The renderer in a scene whose light turns out to come from a few bright texels.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <ranges>

#include "actors/renderer/renderer_actor.hpp"
#include "actors/renderer/tile_surface_scene.hpp"
#include "actors/runtime/deterministic_system.hpp"
#include "tests/actor/renderer/counting_metrics.hpp"
#include "tests/unit/renderer_light/lit_room.hpp"
#include "tests/unit/renderer_tile/made_up_surface.hpp"

namespace darm::renderer {
namespace {

// Made-up light in the tiles of a room whose bright texels are real ones, found at the `found_at`-th look.
struct SpotWorld : MadeUpWorld {
  explicit SpotWorld(const LitRoom& lit) : room(lit) {}
  [[nodiscard]] std::vector<CoarseRequest> shone_on() const override { return first; }
  void find_bright(StoredLight& light) const override {
    if (++looks >= found_at) light.give_bright(room.aimed->bright());
  }
  const LitRoom& room;
  std::vector<CoarseRequest> first;
  int found_at = 1;
  mutable int looks = 0;
};

struct Told {
  std::vector<tile_scheduler::ShadedTile> tiles;
};

class Listener : public runtime::Actor<tile_scheduler::Inbox> {
 public:
  Listener(runtime::Context<tile_scheduler::Inbox> context, std::shared_ptr<Told> told)
      : Actor(std::move(context)), told_(std::move(told)) {}
  void on(tile_scheduler::TilesShaded&& m) { std::ranges::move(m.tiles, std::back_inserter(told_->tiles)); }
  template <class M>
  void on(M&&) {}

 private:
  std::shared_ptr<Told> told_;
};

class RareLightTest : public ::testing::Test {
 protected:
  void SetUp() override {
    dir_ = std::filesystem::temp_directory_path() / ("darm_rare_light_" + std::to_string(::getpid()));
    world_ = std::make_shared<SpotWorld>(room_);
    world_->world.soft_asked = [this](TileId tile, int texel, std::uint32_t sample) {
      if (texel == 0) ++asked_[tile][sample];
      if (order_.size() < 16) order_.push_back(tile);
    };
  }
  void TearDown() override {
    system_.reset();
    store_.reset();
    std::filesystem::remove_all(dir_);
  }
  void run() {
    system_ = std::make_unique<runtime::DeterministicSystem>(2);
    store_ = std::move(*atlas::RadianceStore::open(dir_, {}, *room_.layout));
    RendererParts parts;
    parts.surfaces = world_;
    parts.store = store_;
    parts.levels = level_tiles_of(*room_.layout);
    parts.layout = room_.layout;
    parts.options.coarse_rounds = 4;
    parts.options.coarse_share = 0.5f;  // a round takes no longer than some samples of what is seen, however fast it is
    parts.options.schedule.max_samples = 16;
    parts.scheduler = system_->spawn<Listener>("tile_scheduler", 64, told_);
    parts.coarse = [this](std::shared_ptr<const CoarsePicture> p) { coarse_errors_.push_back(p->errors); };
    parts.metrics = &metrics_;
    auto renderer = system_->spawn<RendererActor>("renderer", 1024, parts);
    std::vector<TileRequest> requests;
    const auto& level = room_.layout->levels.front();
    for (std::uint32_t t = seen_.index(); t < level.tiles_x * level.tiles_y; t += 2) {
      TileRequest request;
      request.tile = TileId(0, t);
      request.weight = 0.01f;
      request.mask = TexelMask::all();
      requests.push_back(request);
    }
    renderer.tell(ShadeTiles(std::make_shared<const std::vector<TileRequest>>(std::move(requests)), 1));
    system_->run_until_idle();
    ASSERT_TRUE(system_->failures().empty());
    ASSERT_FALSE(told_->tiles.empty());
  }
  [[nodiscard]] TileId coarse(std::uint32_t tile) const { return {room_.layout->coarse_level(), tile}; }

  LitRoom room_{spot_light};
  TileId seen_{0, 3};
  std::filesystem::path dir_;
  std::shared_ptr<SpotWorld> world_;
  std::shared_ptr<atlas::RadianceStore> store_;
  std::map<TileId, std::map<std::uint32_t, int>> asked_;  // soft samples of texel 0
  std::vector<TileId> order_;                             // of the first samples
  std::shared_ptr<Told> told_ = std::make_shared<Told>();
  std::vector<std::vector<float>> coarse_errors_;  // of each picture of the coarse level
  CountingMetrics metrics_;
  std::unique_ptr<runtime::DeterministicSystem> system_;
};

TEST_F(RareLightTest, samples_from_before_it_is_known_are_replaced_and_pictures_say_so) {
  world_->found_at = 2;
  run();
  for (const TileId tile : {seen_, coarse(0)}) {
    EXPECT_EQ(asked_[tile][0], 2) << "the first sample is taken again";
    const auto view = store_->read(tile);
    EXPECT_EQ(view->count(atlas::Layer::kSoft, 0), static_cast<float>(asked_[tile].size())) << "and counts once";
  }
  EXPECT_TRUE(std::ranges::any_of(told_->tiles, [](const auto& t) { return t.error == 0.25f; }));
  EXPECT_LT(told_->tiles.back().error, 0.1f);
  EXPECT_TRUE(std::ranges::any_of(coarse_errors_, [](const auto& e) { return std::ranges::min(e) >= 0.25f; }));
  EXPECT_LT(std::ranges::max(coarse_errors_.back()), 0.25f);
}

TEST_F(RareLightTest, what_is_known_from_the_start_is_lit_first_and_nothing_is_replaced) {
  const auto place = room_.aimed->bright().place(0);
  CoarseRequest spot{place.tile, {}};
  spot.mask.set(place.texel % kTileSize, place.texel / kTileSize);
  world_->first = {spot};
  run();
  ASSERT_EQ(order_.size(), 16u);
  EXPECT_TRUE(std::ranges::all_of(order_, [&](TileId t) { return t == coarse(place.tile); }));
  EXPECT_EQ(asked_[seen_][0], 1);
  EXPECT_TRUE(std::ranges::none_of(told_->tiles, [](const auto& t) { return t.error >= 0.25f; }));
}

// Each of the spot's texels says 1 or 0: at half a percent of their sum they need far more than the rounds give.
TEST_F(RareLightTest, bright_texels_have_samples_by_the_error_of_their_light) {
  world_->world.light = [](TileId tile, int texel, std::uint32_t sample) {
    return TexelLight{{}, glm::vec3(noise_of(tile, texel, sample) < 0.5f ? 0.0f : 100.0f)};
  };
  run();
  const auto& bright = room_.aimed->bright();
  float least = 1e9f;
  for (std::size_t i = 0; i < bright.size(); ++i) {
    const auto place = bright.place(i);
    least = std::min(least, store_->read(coarse(place.tile))->count(atlas::Layer::kSoft, place.texel));
  }
  EXPECT_GE(least, 64.0f);
  int texel = 0;  // some other
  while (std::ranges::any_of(std::views::iota(std::size_t{0}, bright.size()), [&](std::size_t i) {
    return bright.place(i).tile == 0 && bright.place(i).texel == texel;
  }))
    ++texel;
  EXPECT_LE(store_->read(coarse(0))->count(atlas::Layer::kSoft, texel), 8.0f) << "the rounds";
}

}  // namespace
}  // namespace darm::renderer
