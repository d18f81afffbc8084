// A private tile: means for one eye, what a moving eye does to them, and the picture.
#include "actors/renderer/view_tile.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "actors/renderer/display_curve.hpp"
#include "tests/unit/renderer_tile/made_up_view.hpp"

namespace darm::renderer {
namespace {

const TileId kTile(0, 7);

ViewDependentLight light_of(float radiance, float ggx_alpha) {
  ViewDependentLight l;
  l.radiance = glm::vec3(radiance);
  l.ggx_alpha = ggx_alpha;
  l.distance = 1;
  return l;
}

// Every other sample of a texel, and of its neighbours the ones in between.
bool flickers(int at, std::uint32_t sample) { return (sample * 7 + static_cast<std::uint32_t>(at)) % 2 == 0; }

class ViewTileTest : public ::testing::Test {
 protected:
  // Brightness follows the eye's x; lobes of `alpha`.
  void follow_the_eye(float alpha) {
    world.light = [alpha](TileId, int, const glm::vec3& eye, std::uint32_t) {
      ViewDependentLight l;
      l.radiance = glm::vec3(eye.x);
      l.ggx_alpha = alpha;
      l.distance = 2;
      return l;
    };
  }
  std::uint8_t code(int x, int y) {
    return tile.draw(slot).image->rgb[static_cast<std::size_t>((y * kSlotSize + x) * 3)];
  }

  MadeUpView world;
  MadeUpSlot slot{kTile, world};
  ViewTileOptions options;
  ViewTile tile{1.0f};
};

TEST_F(ViewTileTest, a_picture_is_due_when_every_wanted_texel_has_light_and_then_when_samples_have_doubled) {
  tile.want(whole_slot());
  tile.see_from({0, 0, 0}, options);
  EXPECT_FALSE(tile.picture_due(options));
  EXPECT_EQ(tile.shade(slot, 1), static_cast<std::uint32_t>(kSlotTexels));
  EXPECT_TRUE(tile.picture_due(options));
  EXPECT_EQ(code(5, 5), srgb_code(0.25f));
  EXPECT_FALSE(tile.picture_due(options));
  tile.shade(slot, 1);
  EXPECT_TRUE(tile.picture_due(options));
  tile.forget_picture();
  EXPECT_TRUE(tile.picture_due(options));
}

TEST_F(ViewTileTest, a_mirror_forgets_at_a_step_but_shows_the_old_light_until_there_is_new) {
  follow_the_eye(0.001f);
  tile.want(whole_slot());
  tile.see_from({0.2f, 0, 0}, options);
  tile.shade(slot, 8);
  EXPECT_EQ(code(3, 3), srgb_code(0.2f));
  tile.see_from({0.2f, 1e-5f, 0}, options);
  EXPECT_EQ(tile.least(), 8) << "a trembling hand is no step";
  tile.see_from({0.6f, 0, 0}, options);
  EXPECT_EQ(tile.least(), 0);
  EXPECT_FALSE(tile.picture_due(options));
  EXPECT_EQ(code(3, 3), srgb_code(0.2f)) << "never black";
  tile.shade(slot, 1);
  EXPECT_TRUE(tile.picture_due(options));
  EXPECT_EQ(code(3, 3), srgb_code(0.6f)) << "nothing of the old eye is left";
}

TEST_F(ViewTileTest, a_rough_surface_keeps_most_of_what_it_has) {
  follow_the_eye(0.8f);
  tile.want(whole_slot());
  tile.see_from({0.2f, 0, 0}, options);
  tile.shade(slot, 16);
  static_cast<void>(tile.draw(slot));
  tile.see_from({0.21f, 0, 0}, options);
  EXPECT_GT(tile.least(), 15);
  tile.shade(slot, 1);
  EXPECT_TRUE(tile.picture_due(options)) << "it is of another eye";
  tile.see_from({3, 0, 0}, options);
  EXPECT_EQ(tile.least(), 0);
}

TEST_F(ViewTileTest, patches_without_private_light_stay_black_beside_those_with_it) {
  world.patch = [](TileId, int x, int) { return x < 16 ? 1u : 2u; };
  SlotMask left;
  for (int y = 0; y < kSlotSize; ++y) left.set_row(y, 0, 9);
  tile.want(left);
  tile.see_from({1, 0, 0}, options);
  tile.shade(slot, 1);
  EXPECT_EQ(code(4, 4), srgb_code(0.25f));
  EXPECT_EQ(code(14, 4), srgb_code(0.25f)) << "filled within the patch";
  EXPECT_EQ(code(20, 4), 0);
}

TEST_F(ViewTileTest, samples_that_are_no_light_become_black_and_empty_texels_do_not_hold_the_tile_up) {
  world.patch = [](TileId, int x, int) { return x == 3 ? 0xffffffffu : 0u; };
  world.light = [](TileId, int at, const glm::vec3&, std::uint32_t) {
    ViewDependentLight l;
    l.radiance = glm::vec3(at % 2 == 0 ? NAN : 0.5f);
    l.ggx_alpha = 0.001f;
    l.distance = 1;
    return l;
  };
  tile.want(whole_slot());
  tile.see_from({1, 0, 0}, options);
  tile.shade(slot, 2);
  EXPECT_TRUE(tile.picture_due(options));
  const auto picture = tile.draw(slot);
  EXPECT_TRUE(std::isfinite(picture.error));
  EXPECT_EQ(tile.wanted(), kSlotTexels - kSlotSize);
}

TEST_F(ViewTileTest, noise_is_told_and_ends_the_work) {
  world.light = [](TileId, int at, const glm::vec3&, std::uint32_t n) {
    return light_of(flickers(at, n) ? 0.5f : 0.1f, 0.001f);
  };
  tile.want(whole_slot());
  tile.see_from({1, 0, 0}, options);
  tile.shade(slot, 16);
  const float early = tile.draw(slot).error;
  EXPECT_FALSE(tile.finished(options, 0.02f));
  tile.shade(slot, 240);
  const float late = tile.draw(slot).error;
  EXPECT_NEAR(late, early / 4, 0.1f * early);
  EXPECT_TRUE(tile.finished(options, 0.02f));
  EXPECT_FALSE(tile.finished(options, 0.0f)) << "no target: it goes on";
}

TEST_F(ViewTileTest, noise_counts_as_it_shows_on_top_of_the_shared_light) {
  float beneath = 0;
  world.light = [&](TileId, int at, const glm::vec3&, std::uint32_t n) {
    auto l = light_of(flickers(at, n) ? 0.04f : 0.0f, 0.001f);
    l.beneath = beneath;
    return l;
  };
  const auto error_on = [&](float light) {
    beneath = light;
    ViewTile own(1.0f);
    own.want(whole_slot());
    own.see_from({1, 0, 0}, options);
    own.shade(slot, 16);
    return own.draw(slot).error;
  };
  const float on_black = error_on(0);
  const float on_grey = error_on(0.3f);
  EXPECT_GT(on_black, 3 * on_grey);
  EXPECT_GT(on_grey, 0.0f);
  EXPECT_EQ(error_on(5), 0.0f) << "it is white whatever comes on top";
}

TEST_F(ViewTileTest, what_its_filter_smears_counts) {
  // Stripes without noise that a wide lobe's filter blurs while samples are few.
  world.light = [](TileId, int at, const glm::vec3&, std::uint32_t) {
    return light_of(at / 4 % 2 == 0 ? 0.5f : 0.1f, 0.5f);
  };
  tile.want(whole_slot());
  tile.see_from({1, 0, 0}, options);
  tile.shade(slot, 16);
  const float smeared = tile.draw(slot).error;
  EXPECT_GT(smeared, 0.03f);
  tile.shade(slot, 240);
  EXPECT_LT(tile.draw(slot).error, 1e-3f) << "the filter is gone";
}

}  // namespace
}  // namespace darm::renderer
