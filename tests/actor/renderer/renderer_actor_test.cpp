#include "actors/renderer/renderer_actor.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>

#include "actors/renderer/display_curve.hpp"
#include "actors/runtime/deterministic_system.hpp"
#include "tests/actor/renderer/counting_metrics.hpp"
#include "tests/unit/renderer_tile/made_up_surface.hpp"

namespace darm::renderer {
namespace {

struct Received {
  std::vector<tile_scheduler::ShadedTile> tiles;
};

// Stands in for the tile scheduler: keeps what it is told.
class Listener : public runtime::Actor<tile_scheduler::Inbox> {
 public:
  Listener(runtime::Context<tile_scheduler::Inbox> context, std::shared_ptr<Received> received)
      : Actor(std::move(context)), received_(std::move(received)) {}
  void on(tile_scheduler::TilesShaded&& m) {
    for (auto& t : m.tiles) received_->tiles.push_back(std::move(t));
  }
  template <class M>
  void on(M&&) {}

 private:
  std::shared_ptr<Received> received_;
};

class RendererActorTest : public ::testing::Test {
 protected:
  void SetUp() override {
    dir_ = std::filesystem::temp_directory_path() / ("darm_renderer_" + std::to_string(::getpid()) + "_" +
                                                     ::testing::UnitTest::GetInstance()->current_test_info()->name());
    options_.schedule.max_samples = 8;
    options_.coarse_rounds = 0;
    surfaces_ = std::make_shared<MadeUpWorld>();
    surfaces_->world.light = [this](TileId tile, int texel, std::uint32_t sample) {
      samples_[tile].insert({texel, sample});
      order_.push_back(tile);
      return TexelLight{glm::vec3(0.2f), glm::vec3(noise_of(tile, texel, sample))};
    };
  }
  void TearDown() override {
    system_.reset();
    store_.reset();
    std::filesystem::remove_all(dir_);
  }
  void start() {
    system_ = std::make_unique<runtime::DeterministicSystem>(2);
    const std::vector<std::uint32_t> tiles{100, 4};
    if (!store_) store_ = std::move(*atlas::RadianceStore::open(dir_, {}, tiles));
    received_ = std::make_shared<Received>();
    RendererParts parts;
    parts.surfaces = surfaces_;
    parts.store = store_;
    parts.levels = {{10, 10}, {2, 2}};
    parts.options = options_;
    parts.scheduler = system_->spawn<Listener>("tile_scheduler", 64, received_);
    parts.coarse = [this](std::shared_ptr<const CoarsePicture> p) { coarse_.push_back(std::move(p)); };
    parts.metrics = &metrics_;
    renderer_ = system_->spawn<RendererActor>("renderer", 1024, parts);
  }
  static TileRequest request(std::uint32_t index, int rows = 30, bool display = true) {
    TileRequest r;
    r.tile = TileId(0, index);
    r.weight = 0.01f;
    r.display = display;
    for (int i = 0; i < rows * kTileSize; ++i) r.mask.set(i % kTileSize, i / kTileSize);
    return r;
  }
  void ask(std::vector<TileRequest> work) {
    renderer_.tell(ShadeTiles(std::make_shared<const std::vector<TileRequest>>(std::move(work)), ++working_set_));
  }
  [[nodiscard]] std::set<std::uint32_t> pictured() const {
    std::set<std::uint32_t> tiles;
    for (const auto& t : received_->tiles) tiles.insert(t.tile.index());
    return tiles;
  }

  std::filesystem::path dir_;
  RendererOptions options_;
  std::shared_ptr<MadeUpWorld> surfaces_;
  std::shared_ptr<atlas::RadianceStore> store_;
  std::map<TileId, std::set<std::pair<int, std::uint32_t>>> samples_;
  std::vector<TileId> order_;
  CountingMetrics metrics_;
  std::shared_ptr<Received> received_;
  std::vector<std::shared_ptr<const CoarsePicture>> coarse_;
  std::unique_ptr<runtime::DeterministicSystem> system_;
  runtime::Ref<Inbox> renderer_;
  std::uint64_t working_set_ = 0;
};

TEST_F(RendererActorTest, every_requested_tile_gets_pictures_until_it_is_done) {
  start();
  ask({request(1), request(2), request(55)});
  system_->run_until_idle();
  EXPECT_EQ(pictured(), (std::set<std::uint32_t>{1, 2, 55}));
  for (const std::uint32_t i : {1u, 2u, 55u}) {
    EXPECT_EQ(samples_[TileId(0, i)].size(), 900u * 8);
    std::uint32_t version = 0;
    float error = 1;
    for (const auto& t : received_->tiles) {
      if (t.tile.index() != i) continue;
      EXPECT_GT(t.version, version);
      EXPECT_LE(t.error, error * 1.05f);
      version = t.version;
      error = t.error;
      ASSERT_TRUE(t.image);
    }
  }
  EXPECT_GE(metrics_.counts["darm_renderer_texel_samples_total"], 3 * 900 * 8 + 3 * 900);  // soft, and sharp once
  EXPECT_TRUE(system_->failures().empty());
}

TEST_F(RendererActorTest, replaced_working_set_stops_the_old_one) {
  options_.schedule.max_samples = 4096;
  options_.batch_ms = 1;
  start();
  ask({request(1)});
  bool replaced = false;
  surfaces_->world.light = [&](TileId tile, int, std::uint32_t) {
    order_.push_back(tile);
    if (order_.size() == 2000) {
      ask({request(2, 1)});
      replaced = true;
    }
    return TexelLight{};
  };
  options_.schedule.max_samples = 4096;
  system_->run_until_idle();
  EXPECT_TRUE(replaced);
  const auto old_ones = std::count(order_.begin(), order_.end(), TileId(0, 1));
  EXPECT_LT(old_ones, 10'000);
  EXPECT_EQ(order_.back(), TileId(0, 2));
}

TEST_F(RendererActorTest, nothing_is_shaded_outside_the_mask) {
  start();
  ask({request(3, 7), request(4, 30, false)});
  system_->run_until_idle();
  ASSERT_EQ(samples_.size(), 2u);
  for (const auto& [texel, sample] : samples_[TileId(0, 3)]) EXPECT_LT(texel, 7 * kTileSize);
  EXPECT_EQ(pictured(), std::set<std::uint32_t>{3});
}

TEST_F(RendererActorTest, warm_store_is_shown_before_anything_is_shaded) {
  options_.schedule.max_samples = 4;
  start();
  ask({request(1)});
  system_->run_until_idle();
  const auto last = received_->tiles.back().image->rgb;
  system_.reset();
  options_.schedule.max_samples = 64;
  start();
  order_.clear();
  bool shown_first = false;
  surfaces_->world.light = [&](TileId, int, std::uint32_t) {
    if (order_.empty()) shown_first = !received_->tiles.empty() && received_->tiles[0].image->rgb == last;
    order_.push_back(TileId(0, 1));
    return TexelLight{};
  };
  ask({request(1), request(2)});
  system_->run_until_idle();
  EXPECT_TRUE(shown_first);
  EXPECT_FALSE(order_.empty());
}

TEST_F(RendererActorTest, tile_that_comes_back_is_shown_again) {
  start();
  ask({request(1)});
  system_->run_until_idle();
  ask({request(2)});
  system_->run_until_idle();
  received_->tiles.clear();
  ask({request(1)});
  system_->run_until_idle();
  EXPECT_EQ(received_->tiles.size(), 1u);
}

TEST_F(RendererActorTest, failing_tile_is_tried_twice_and_then_left_alone) {
  start();
  int tries = 0;
  surfaces_->world.light = [&](TileId tile, int, std::uint32_t) {
    if (tile.index() == 1) {
      ++tries;
      throw std::runtime_error("a ray went astray");
    }
    return TexelLight{glm::vec3(0.5f), {}};
  };
  ask({request(1), request(2)});
  system_->run_until_idle();
  EXPECT_EQ(tries, 2);
  EXPECT_EQ(pictured(), std::set<std::uint32_t>{2});
  EXPECT_EQ(metrics_.counts["darm_renderer_quarantined_tiles_total"], 1);
  EXPECT_TRUE(system_->failures().empty());
}

TEST_F(RendererActorTest, coarse_level_is_lit_at_start_and_gets_better) {
  options_.coarse_rounds = 4;
  start();
  system_->run_until_idle();
  ASSERT_EQ(coarse_.size(), 4u);  // the first pass, then 1, 2 and 4 samples
  for (std::uint32_t i = 0; i < coarse_.size(); ++i) {
    EXPECT_EQ(coarse_[i]->version, i + 1);
    EXPECT_EQ(coarse_[i]->width, 60u);
    EXPECT_EQ(coarse_[i]->rgb.size(), 60u * 60 * 3);
    for (const auto v : coarse_[i]->rgb) ASSERT_GT(v, 0);
    ASSERT_EQ(coarse_[i]->errors.size(), 4u);
    for (const float e : coarse_[i]->errors) EXPECT_GT(e, 0);
  }
  for (std::size_t t = 0; t < 4; ++t) EXPECT_LT(coarse_.back()->errors[t], coarse_.front()->errors[t]);
  for (std::uint32_t t = 0; t < 4; ++t) EXPECT_EQ(samples_[TileId(1, t)].size(), 900u * 4);
}

TEST_F(RendererActorTest, coarse_level_does_not_hold_up_visible_tiles) {
  options_.coarse_rounds = 64;
  options_.schedule.max_samples = 16;
  start();
  ask({request(1), request(2)});
  std::size_t coarse_before = 0;
  std::size_t visible = 0;
  surfaces_->world.soft_asked = [&](TileId tile, int, std::uint32_t) {
    if (tile.level() == 0) ++visible;
    if (tile.level() == 1 && visible < 2u * 900 * 16) ++coarse_before;
  };
  system_->run_until_idle();
  EXPECT_EQ(visible, 2u * 900 * 16);
  EXPECT_LT(coarse_before, visible);
}

TEST_F(RendererActorTest, tiles_outside_the_atlas_are_ignored) {
  start();
  TileRequest wild = request(0);
  wild.tile = TileId(9, 12345);
  surfaces_->world.patch = [](TileId tile, int, int) { return tile.level() > 1 ? kNobody : 0u; };
  ask({wild, request(100000), request(1)});
  system_->run_until_idle();
  EXPECT_TRUE(pictured().contains(1));
  EXPECT_TRUE(system_->failures().empty());
}

TEST_F(RendererActorTest, a_restart_shows_stored_pictures_before_it_computes_anything) {
  start();
  ask({request(1), request(2)});
  system_->run_until_idle();
  std::map<std::uint32_t, std::shared_ptr<const TileImage>> last;
  for (const auto& t : received_->tiles) last[t.tile.index()] = t.image;
  order_.clear();
  options_.schedule.max_samples = 64;
  start();
  std::size_t shown_before_light = 0;
  surfaces_->world.light = [&](TileId, int, std::uint32_t) {
    if (shown_before_light == 0) shown_before_light = received_->tiles.size();
    return TexelLight{glm::vec3(0.2f), glm::vec3(0.3f)};
  };
  ask({request(1), request(2), request(3)});
  system_->run_until_idle();
  ASSERT_EQ(shown_before_light, 2u);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(received_->tiles[i].image->rgb, last[received_->tiles[i].tile.index()]->rgb);
  EXPECT_EQ(pictured(), (std::set<std::uint32_t>{1, 2, 3}));
}

TEST_F(RendererActorTest, pictures_of_another_exposure_are_not_shown_again) {
  start();
  ask({request(1)});
  system_->run_until_idle();
  options_.display.exposure = 0.5f;
  start();
  ask({request(1)});
  system_->run_until_idle();
  ASSERT_FALSE(received_->tiles.empty());
  EXPECT_NE(received_->tiles[0].image->rgb[3 * 100], 0);
  EXPECT_LT(received_->tiles[0].image->rgb[3 * 100], srgb_code(0.5f));
}

TEST_F(RendererActorTest, a_restart_shows_the_coarse_level_at_once_and_goes_on_where_it_stopped) {
  options_.coarse_rounds = 4;
  start();
  system_->run_until_idle();
  ASSERT_FALSE(coarse_.empty());
  const auto last = coarse_.back();
  coarse_.clear();
  samples_.clear();
  options_.coarse_rounds = 5;
  start();
  system_->run_until_idle();
  ASSERT_GE(coarse_.size(), 2u);
  EXPECT_EQ(coarse_.front()->rgb, last->rgb);
  EXPECT_EQ(coarse_.front()->errors, last->errors);
  EXPECT_EQ(samples_[TileId(1, 0)].size(), 900u);  // one round, not five
}

}  // namespace
}  // namespace darm::renderer
