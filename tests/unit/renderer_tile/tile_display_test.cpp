#include "actors/renderer/tile_display.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <memory>
#include <optional>

#include "actors/renderer/display_curve.hpp"
#include "actors/renderer/stored_light.hpp"
#include "actors/renderer/texel_shading.hpp"
#include "tests/unit/renderer_tile/made_up_surface.hpp"

namespace darm::renderer {
namespace {

class TileDisplayTest : public ::testing::Test {
 protected:
  void SetUp() override {
    dir_ = std::filesystem::temp_directory_path() / ("darm_display_" + std::to_string(::getpid()) + "_" +
                                                     ::testing::UnitTest::GetInstance()->current_test_info()->name());
    const std::vector<std::uint32_t> tiles{9};
    auto opened = atlas::RadianceStore::open(dir_, {}, tiles);
    ASSERT_TRUE(opened);
    store_ = std::move(*opened);
  }
  void TearDown() override {
    store_.reset();
    std::filesystem::remove_all(dir_);
  }
  // A first pass where one is due, then `passes` of soft light for all.
  ShadingResult shade(TileId id, std::uint32_t passes, const TexelMask& mask = TexelMask::all()) {
    if (survey_tile(*store_, id, mask, *world_.tile(id)).unshaded > 0) first_pass(id, mask);
    auto result = shade_tile(*store_, id, mask, passes, *world_.tile(id));
    EXPECT_TRUE(result);
    facts_->get(id, world_, *store_)->learn_albedo(*world_.tile(id), mask);
    return *result;
  }
  ShadingResult first_pass(TileId id, const TexelMask& mask = TexelMask::all()) {
    auto result = shade_tile(*store_, id, mask, 1, *world_.tile(id));
    EXPECT_TRUE(result);
    facts_->get(id, world_, *store_)->learn_albedo(*world_.tile(id), mask);
    return *result;
  }
  TilePicture draw(TileId id, float filter = 384, const TexelMask& mask = TexelMask::all()) {
    TileDisplay display(*store_, *facts_, DisplayOptions{1.0f, filter});
    auto picture = display.draw(id, level_, mask);
    EXPECT_TRUE(picture);
    return picture ? *picture : TilePicture{};
  }
  static int code(const TilePicture& p, int x, int y, int c = 0) {  // payload coordinates, -1..30
    return p.image->rgb[static_cast<std::size_t>(((y + 1) * kSlotSize + x + 1) * 3 + c)];
  }

  std::filesystem::path dir_;
  std::unique_ptr<atlas::RadianceStore> store_;
  MadeUpWorld world_;
  std::unique_ptr<TileFactsCache> facts_ = std::make_unique<TileFactsCache>();
  LevelTiles level_{3, 3};
  TileId middle_{0, 4};
};

TEST_F(TileDisplayTest, flat_light_gives_its_flat_colour) {
  world_.world.light = [](TileId, int, std::uint32_t) { return TexelLight{glm::vec3(0.1f), glm::vec3(0.25f)}; };
  shade(middle_, 1);
  const auto picture = draw(middle_);
  for (std::size_t i = 0; i < picture.image->rgb.size(); ++i) ASSERT_EQ(picture.image->rgb[i], srgb_code(0.35f));
  EXPECT_EQ(picture.samples, 1.0f);
}

TEST_F(TileDisplayTest, a_patch_without_light_is_grey_where_asked_for_and_else_as_what_is_beside_it) {
  world_.world.patch = [](TileId, int x, int) { return x < 15 ? 1u : 2u; };
  world_.world.light = [](TileId, int, std::uint32_t) { return TexelLight{glm::vec3(0), glm::vec3(0.5f, 0, 0)}; };
  TexelMask left;
  for (int y = 0; y < kTileSize; ++y) left.set_row(0, 14, y);
  first_pass(middle_, left);
  TileDisplay display(*store_, *facts_, DisplayOptions{1.0f, 384});
  const auto beside = display.draw(middle_, level_, left).value();
  EXPECT_EQ(code(beside, 25, 10, 0), code(beside, 3, 10, 0));
  EXPECT_EQ(code(beside, 25, 10, 1), 0);
  const auto grey = display.draw(middle_, level_, left, Unlit::kGrey).value();
  EXPECT_EQ(code(grey, 3, 10, 0), code(beside, 3, 10, 0));
  EXPECT_EQ(code(grey, 25, 10, 0), code(grey, 25, 10, 1));
  EXPECT_EQ(code(grey, 25, 10, 1), code(grey, 25, 10, 2));
  EXPECT_GT(code(grey, 25, 10, 1), 0);
}

TEST_F(TileDisplayTest, unshaded_tile_has_no_picture) {
  TileDisplay display(*store_, *facts_, {});
  EXPECT_FALSE(display.draw(middle_, level_, TexelMask::all()));
}

TEST_F(TileDisplayTest, a_level_that_is_not_there_has_no_picture) {
  TileDisplay display(*store_, *facts_, {});
  EXPECT_FALSE(display.draw(middle_, LevelTiles{}, TexelMask::all()));
}

TEST_F(TileDisplayTest, border_is_the_neighbours_texel_where_it_is_shaded) {
  world_.world.light = [](TileId id, int texel, std::uint32_t) {
    return TexelLight{glm::vec3(static_cast<float>(id.index()) / 10 + static_cast<float>(texel % 30) / 1000), {}};
  };
  for (std::uint32_t i = 0; i < 8; ++i) shade(TileId(0, i), 1);
  const auto picture = draw(middle_);
  EXPECT_EQ(code(picture, -1, 7), srgb_code(0.3f + 0.029f));
  EXPECT_EQ(code(picture, 30, 7), srgb_code(0.5f));
  EXPECT_EQ(code(picture, 4, -1), srgb_code(0.1f + 0.004f));
  EXPECT_EQ(code(picture, -1, -1), srgb_code(0.0f + 0.029f));
  // tile 8 is not shaded: its corner repeats what is near in the same patch
  EXPECT_NEAR(code(picture, 30, 30), srgb_code(0.5f), 60);
}

TEST_F(TileDisplayTest, filter_removes_noise_and_keeps_texture_and_patch_edges) {
  world_.world.patch = [](TileId, int x, int) { return x < 15 ? 1u : 2u; };
  world_.world.albedo = [](TileId, int x, int y) { return glm::vec3((x / 3 + y / 3) % 2 ? 0.8f : 0.1f); };
  world_.world.light = [](TileId id, int t, std::uint32_t s) {
    const float irradiance = (t % 30 < 15 ? 0.6f : 0.1f) * 2 * noise_of(id, t, s);
    return TexelLight{glm::vec3(0.0f), glm::vec3(((t % 30 / 3 + t / 30 / 3) % 2 ? 0.8f : 0.1f) * irradiance)};
  };
  shade(middle_, 4);
  const auto rms = [&](const TilePicture& p) {
    double sum = 0;
    for (int t = 0; t < kTileTexels; ++t) {
      const float truth = (t % 30 < 15 ? 0.6f : 0.1f) * ((t % 30 / 3 + t / 30 / 3) % 2 ? 0.8f : 0.1f);
      sum += std::pow((code(p, t % 30, t / 30) - srgb_code(truth)) / 255.0, 2);
    }
    return std::sqrt(sum / kTileTexels);
  };
  const double raw = rms(draw(middle_, 0));
  const double filtered = rms(draw(middle_));
  EXPECT_LT(filtered, raw / 4);
}

// A lamp's spot is as bright as an outlier, but in every sample.
TEST_F(TileDisplayTest, what_all_samples_say_is_no_outlier) {
  constexpr int kSpot = 12 * kTileSize + 12;
  world_.world.light = [](TileId id, int t, std::uint32_t s) {
    return TexelLight{{}, glm::vec3(t == kSpot ? 20.0f + 10.0f * noise_of(id, t, s) : 0.02f)};
  };
  shade(middle_, 16);
  EXPECT_EQ(draw(middle_).lost_share, 0.0f);
  world_.world.light = [](TileId, int t, std::uint32_t s) {
    return TexelLight{{}, glm::vec3(t == kSpot && s == 3 ? 400.0f : 0.02f)};
  };
  shade(TileId(0, 8), 16);
  EXPECT_GT(draw(TileId(0, 8)).lost_share, 0.1f) << "one of sixteen is";
}

TEST_F(TileDisplayTest, few_samples_are_replaced_and_many_are_not) {
  world_.world.light = [](TileId, int, std::uint32_t) { return TexelLight{{}, glm::vec3(0.5f)}; };
  shade(TileId(0, 0), 4);
  shade(TileId(0, 1), 32);
  world_.world.light = [](TileId, int, std::uint32_t) { return TexelLight{{}, glm::vec3(0.25f)}; };
  for (const std::uint32_t tile : {0u, 1u}) {
    const auto before = store_->read(TileId(0, tile))->count(atlas::Layer::kSoft, 40);
    ASSERT_TRUE(shade_tile(*store_, TileId(0, tile), TexelMask::all(), 2, *world_.tile(TileId(0, tile)), 0xffffffffu,
                           Few::kReplaced));
    const auto view = *store_->read(TileId(0, tile));
    if (before <= kReplacedSamples) {
      EXPECT_EQ(view.count(atlas::Layer::kSoft, 40), 2);
      EXPECT_FLOAT_EQ(view.mean(atlas::Layer::kSoft, 40).x, 0.5f) << "0.25 by an albedo of a half";
      EXPECT_EQ(view.variance_of_mean(atlas::Layer::kSoft, 40, 1), 0.0f);
    } else {
      EXPECT_EQ(view.count(atlas::Layer::kSoft, 40), before + 2);
      EXPECT_GT(view.mean(atlas::Layer::kSoft, 40).x, 0.9f);
    }
  }
}

// A room lit by a small bright spot: one sample in 300 has nearly all the light, and as chance has it one tile many.
TEST_F(TileDisplayTest, rare_light_shows_no_tiles) {
  world_.world.light = [](TileId id, int t, std::uint32_t s) {
    const bool lucky = noise_of(id, t, s) < (id.index() % 3 == 1 ? 1.0f / 100 : 1.0f / 900);
    return TexelLight{{}, glm::vec3(lucky ? 60.0f : 0.02f)};
  };
  for (std::uint32_t i = 0; i < 9; ++i) shade(TileId(0, i), 1);
  const auto left = draw(TileId(0, 3)), middle = draw(middle_);
  EXPECT_GT(middle.lost_share, 0.4f);
  double apart = 0, across = 0, linear = 0;
  for (int y = 0; y < kTileSize; ++y) {
    apart += code(left, 29, y) - code(middle, 0, y);
    across += code(left, 15, y) - code(middle, 15, y);
    linear += code(middle, 15, y);
  }
  EXPECT_LT(std::abs(apart / kTileSize), 4) << "to either side of a border";
  EXPECT_LT(across / kTileSize, -10) << "or all is alike";
  EXPECT_GT(linear / kTileSize, 60);
}

TEST_F(TileDisplayTest, light_that_is_not_shown_yet_is_there_for_paths) {
  world_.world.light = [this](TileId id, int t, std::uint32_t) {
    return TexelLight{{}, glm::vec3(id == middle_ && t == 465 ? 9000.0f : 0.1f)};
  };
  for (std::uint32_t i = 0; i < 9; ++i) shade(TileId(0, i), 2);
  TileDisplay display(*store_, *facts_, DisplayOptions{1.0f, 384});
  ASSERT_TRUE(display.draw(middle_, level_, TexelMask::all()));
  const auto stored = stored_texels(*store_->read(middle_), display.filtered());
  double shown = 0, all = 0;
  for (int t = 0; t < kTileTexels; ++t) {
    const auto& texel =
        display.filtered()[static_cast<std::size_t>((t / kTileSize + 1) * kSlotSize + t % kTileSize + 1)];
    shown += double{texel.irradiance[1]};
    all += double{stored[static_cast<std::size_t>(t)].soft.y};
  }
  EXPECT_LT(shown / kTileTexels, 0.5) << "a lone sample at most doubles the light around it, which is 0.2";
  EXPECT_GT(all / kTileTexels, 4) << "of 20, what the middle of three tiles has";
}

TEST_F(TileDisplayTest, texels_inside_other_geometry_do_not_darken_those_beside_them) {
  world_.world.patch = [](TileId, int, int y) { return y < 20 ? 1u : 2u; };
  world_.world.light = [](TileId id, int t,
                          std::uint32_t s) {  // a wall stands on the left third, all over the lower patch
    if (t % 30 < 10 || t / 30 >= 20) return TexelLight{};
    return TexelLight{glm::vec3(0.1f), glm::vec3(0.4f * (0.8f + 0.4f * noise_of(id, t, s)))};
  };
  shade(middle_, 32);
  TileDisplay display(*store_, *facts_, DisplayOptions{1.0f, 384});
  const auto picture = display.draw(middle_, level_, TexelMask::all()).value();
  for (int y = 1; y < 19; ++y) {
    EXPECT_NEAR(code(picture, 10, y), srgb_code(0.5f), 3);
    EXPECT_NEAR(code(picture, 9, y), srgb_code(0.5f), 3);  // what a bilinear tap at the contact reads
    EXPECT_EQ(code(picture, 8, y), 0);
  }
  for (int x = 1; x < 29; ++x) EXPECT_EQ(code(picture, x, 25), 0);  // all dark is dark
  const auto stored = stored_texels(*store_->read(middle_), display.filtered());
  EXPECT_FALSE(stored[9].known);  // no path ends there
  EXPECT_TRUE(stored[10].known);
}

TEST_F(TileDisplayTest, filter_vanishes_as_samples_come_in) {
  // A step of light inside one patch: with enough samples the picture is the plain mean.
  world_.world.light = [](TileId id, int t, std::uint32_t s) {
    return TexelLight{{}, glm::vec3((t % 30 < 11 ? 0.5f : 0.02f) * 2 * noise_of(id, t, s))};
  };
  for (int i = 0; i < 8; ++i) shade(middle_, 500);
  const auto with = draw(middle_);
  const auto without = draw(middle_, 0);
  EXPECT_EQ(with.image->rgb, without.image->rgb);
}

TEST_F(TileDisplayTest, step_of_light_inside_a_patch_stays_sharp_when_it_stands_out_of_the_noise) {
  world_.world.light = [](TileId id, int t, std::uint32_t s) {
    return TexelLight{{}, glm::vec3((t % 30 < 15 ? 0.6f : 0.05f) * (0.8f + 0.4f * noise_of(id, t, s)))};
  };
  shade(middle_, 8);
  const auto picture = draw(middle_);
  for (int y = 0; y < 30; ++y) {
    EXPECT_NEAR(code(picture, 12, y), srgb_code(0.6f), 8);
    EXPECT_NEAR(code(picture, 17, y), srgb_code(0.05f), 8);
  }
}

TEST_F(TileDisplayTest, texels_outside_the_mask_are_filled_from_their_own_patch) {
  world_.world.patch = [](TileId, int x, int) { return x < 15 ? 1u : 2u; };
  world_.world.light = [](TileId, int t, std::uint32_t) {
    return TexelLight{glm::vec3(t % 30 < 15 ? 0.7f : 0.05f), {}};
  };
  TexelMask mask;
  mask.set(2, 2);
  mask.set(27, 27);
  first_pass(middle_, mask);
  const auto picture = draw(middle_, 384, mask);
  EXPECT_EQ(code(picture, 14, 29), srgb_code(0.7f));
  EXPECT_EQ(code(picture, 15, 0), srgb_code(0.05f));
}

TEST_F(TileDisplayTest, error_is_that_of_a_pixel_which_reads_five_texels) {
  world_.world.light = [](TileId id, int t, std::uint32_t s) {
    return TexelLight{{}, glm::vec3(0.3f * 2 * noise_of(id, t, s))};
  };
  const auto truth_of = [](const TilePicture& p) {
    double sum = 0;
    for (int y = 1; y < 29; ++y)
      for (int x = 1; x < 29; ++x) {
        const int five = code(p, x, y) + code(p, x - 1, y) + code(p, x + 1, y) + code(p, x, y - 1) + code(p, x, y + 1);
        sum += std::pow((five / 5.0 - srgb_code(0.3f)) / 255.0, 2);
      }
    return std::sqrt(sum / (28 * 28));
  };
  for (const std::uint32_t passes : {8u, 24u, 96u}) {
    shade(middle_, passes);
    const auto plain = draw(middle_, 0);
    EXPECT_NEAR(plain.error / truth_of(plain), 1.0, 0.25) << passes;
    const auto filtered = draw(middle_);  // its texels are off alike: a pixel's mean takes little away
    EXPECT_NEAR(filtered.error / truth_of(filtered), 1.0, 0.4) << passes;
  }
}

TEST_F(TileDisplayTest, filled_texels_are_off_by_as_much_as_the_known_ones_differ) {
  float spread = 0;
  const auto light_of = [&](TileId id, int t) { return 0.3f * (1 + spread * (2 * noise_of(id, t, 0) - 1)); };
  world_.world.light = [&](TileId id, int t, std::uint32_t) { return TexelLight{glm::vec3(light_of(id, t)), {}}; };
  TexelMask known;
  for (int t = 0; t < kTileTexels; t += 3) known.set(t % kTileSize, t / kTileSize);
  const auto error_and_truth = [&](float by) {
    spread = by;
    shade(middle_, 8, known);
    const auto picture = draw(middle_, 0);
    double sum = 0;
    for (int t = 0; t < kTileTexels; ++t)
      sum += std::pow((code(picture, t % kTileSize, t / kTileSize) - srgb_code(light_of(middle_, t))) / 255.0, 2);
    return std::pair(double{picture.error}, std::sqrt(sum / kTileTexels));
  };
  const auto [flat, nothing] = error_and_truth(0);
  EXPECT_LT(nothing, 0.002);
  EXPECT_LT(flat, 0.02) << "a quarter of the range, if they told nothing of each other";
  TearDown();
  SetUp();
  const auto [rough, truth] = error_and_truth(0.8f);
  EXPECT_GT(truth, 0.05);
  EXPECT_GT(rough / truth, 0.7);
  EXPECT_LT(rough / truth, 1.4);
}

TEST_F(TileDisplayTest, noise_over_white_is_no_error) {
  float scale = 0;
  world_.world.light = [&](TileId id, int t, std::uint32_t s) {
    return TexelLight{{}, glm::vec3(scale * (0.5f + noise_of(id, t, s)))};
  };
  const auto error_at = [&](float light) {
    scale = light;
    shade(middle_, 16);
    return draw(middle_, 0).error;
  };
  const float middle = error_at(0.3f);
  EXPECT_GT(middle, 0.005f);
  EXPECT_EQ(error_at(1000), 0.0f) << "means rise far over white, whatever was there before";
}

TEST_F(TileDisplayTest, light_that_is_no_number_never_reaches_the_picture) {
  world_.world.light = [](TileId, int t, std::uint32_t s) {
    const bool bad = t == 40 || s % 3 == 1;
    return TexelLight{{}, glm::vec3(bad ? std::nanf("") : 0.3f)};
  };
  const auto result = shade(middle_, 4);
  EXPECT_GT(result.quarantined, 0u);
  EXPECT_EQ(result.progress.least, 4.0f);
  const auto picture = draw(middle_, 0);
  EXPECT_EQ(code(picture, 3, 3), srgb_code(0.3f));
}

TEST_F(TileDisplayTest, restart_continues_the_sequence) {
  std::vector<std::uint32_t> numbers;
  world_.world.soft_asked = [&](TileId, int t, std::uint32_t s) {
    if (t == 7) numbers.push_back(s);
  };
  shade(middle_, 2);
  store_.reset();
  const std::vector<std::uint32_t> tiles{9};
  store_ = std::move(*atlas::RadianceStore::open(dir_, {}, tiles));
  shade(middle_, 3);
  EXPECT_EQ(numbers, (std::vector<std::uint32_t>{0, 1, 2, 3, 4}));
}

TEST_F(TileDisplayTest, newly_seen_texels_catch_up_first) {
  TexelMask some;
  for (int x = 0; x < 10; ++x) some.set(x, 0);
  shade(middle_, 8, some);
  TexelMask more = some;
  for (int x = 0; x < 10; ++x) more.set(x, 1);
  EXPECT_EQ(first_pass(middle_, more).progress.unshaded, 0u);
  const auto result = shade(middle_, 4, more);
  EXPECT_EQ(result.progress.least, 4.0f);
  EXPECT_EQ(result.progress.mean, 6.0f);
  EXPECT_EQ(result.progress.texels, 20u);
}

TEST_F(TileDisplayTest, first_pass_takes_soft_light_for_one_texel_in_four_and_the_picture_has_it_everywhere) {
  world_.world.light = [](TileId, int, std::uint32_t) { return TexelLight{glm::vec3(0.1f), glm::vec3(0.25f)}; };
  int asked = 0;
  world_.world.soft_asked = [&](TileId, int, std::uint32_t) { ++asked; };
  const auto result = first_pass(middle_);
  EXPECT_EQ(asked, 225);
  EXPECT_EQ(result.progress.unshaded, 0u);
  EXPECT_EQ(result.progress.mean, 0.25f);
  const auto picture = draw(middle_);
  for (int t = 0; t < kTileTexels; ++t) ASSERT_EQ(code(picture, t % 30, t / 30), srgb_code(0.35f)) << t;
}

TEST_F(TileDisplayTest, first_pass_leaves_no_patch_without_soft_light) {
  // Columns of one texel: half of them have no texel that leads a 2x2 block.
  world_.world.patch = [](TileId, int x, int) { return static_cast<std::uint32_t>(x); };
  world_.world.light = [](TileId, int t, std::uint32_t) {
    return TexelLight{{}, glm::vec3(static_cast<float>(t % 30 + 1) / 40)};
  };
  first_pass(middle_);
  const auto picture = draw(middle_);
  for (int x = 0; x < 30; ++x) EXPECT_EQ(code(picture, x, 9), srgb_code(static_cast<float>(x + 1) / 40)) << x;
}

TEST_F(TileDisplayTest, sharp_light_is_sampled_again_where_its_samples_differ) {
  world_.world.light = [](TileId id, int t, std::uint32_t s) {
    return TexelLight{glm::vec3(t % 30 < 15 ? 0.5f : (noise_of(id, t, s) < 0.5f ? 0.0f : 1.0f)), glm::vec3(0.1f)};
  };
  for (int i = 0; i < 5; ++i) shade(middle_, 8);
  const auto light = store_->read(middle_);
  ASSERT_TRUE(light);
  EXPECT_EQ(light->count(atlas::Layer::kSoft, 0), 40.0f);
  EXPECT_LE(light->count(atlas::Layer::kSharp, 0), 16.0f);
  EXPECT_EQ(light->count(atlas::Layer::kSharp, 20), 80.0f);
}

TEST_F(TileDisplayTest, coverage_is_the_mean_alpha_with_border) {
  world_.world.translucent = true;
  world_.world.alpha = [](TileId id, int x, int) { return id.index() == 3 ? 0.25f : x == 5 ? 0.5f : 1.0f; };
  const auto coverage = cover_tile(middle_, level_, world_);
  ASSERT_TRUE(coverage);
  EXPECT_EQ((*coverage)[5 * kSlotSize + 6], 128);
  EXPECT_EQ((*coverage)[5 * kSlotSize + 7], 255);
  EXPECT_EQ((*coverage)[5 * kSlotSize], 64);
  world_.world.alpha = [](TileId, int, int) { return 1.0f; };
  EXPECT_FALSE(cover_tile(middle_, level_, world_));
}

// On the border with the next tile, which knows of it or is the one that does not.
TEST_F(TileDisplayTest, light_from_beyond_a_wall_is_not_shown_before_it) {
  const TileId right(0, 5);
  world_.world.light = [&](TileId id, int, std::uint32_t) {
    return TexelLight{{}, glm::vec3(id == right ? 1.0f : 0.05f)};
  };
  const auto shown = [&](std::optional<TileId> knows, int bit) {
    world_.world.walls = [=](TileId id) {
      TileWalls walls;
      if (knows && id == *knows) walls.rows.fill(1u << bit);
      return walls;
    };
    facts_ = std::make_unique<TileFactsCache>();
    first_pass(middle_);
    first_pass(right);
    const auto picture = draw(middle_);
    return code(picture, kTileSize - 1, 15);
  };
  const int dark = srgb_code(0.05f);
  EXPECT_GT(shown({}, 0), dark + 20);
  EXPECT_NEAR(shown(middle_, kTileSize), dark, 1);
  EXPECT_NEAR(shown(right, 0), dark, 1);
}

}  // namespace
}  // namespace darm::renderer
