// What a view's picture is like, and what that does to its errors.
#include "actors/tile_scheduler/view_tone.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "actors/scene/view_materials.hpp"
#include "actors/tile_scheduler/view_demand.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr std::uint32_t kSide = 2 * kTileSize;

CoarseLuma picture_of(const std::function<int(std::uint32_t x, std::uint32_t y)>& code) {
  CoarseLuma out{kSide, kSide, {}};
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x) out.luma.push_back(static_cast<std::uint8_t>(code(x, y)));
  return out;
}

// Looks at every texel once; all surfaces reflect half, and what depends on the eye is worth 0.1.
VisibleSet view_of_all() {
  VisibleSet view;
  SampleTaps taps;
  Chain chain;
  chain.tiles[0] = TileId(0, 7);
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x) {
      taps.chain = view.add(chain, 1);
      taps.coarse = {static_cast<std::uint16_t>(x * 8 + 4), static_cast<std::uint16_t>(y * 8 + 4)};
      view.add_taps(taps);
      view.add_omitted(0.01, 0.5);
      view.add_samples(1);
    }
  return view;
}

TEST(ViewTone, BlackAndWhiteHaveNoRoomForErrors) {
  const auto view = view_of_all();
  const auto night = picture_of([](auto, auto) { return 0; });
  const auto black = tone_of(view, &night);
  EXPECT_EQ(black.variety, 0.0f);
  EXPECT_EQ(black.brightness, 0.0f);
  EXPECT_EQ(omitted_error(view, black), 0.0f) << "no light, no reflection";
  EXPECT_EQ(error_options(black).coarse_tex, black.coarse_light);
  const auto bright = picture_of([](auto, auto) { return 255; });
  const auto white = tone_of(view, &bright);
  EXPECT_EQ(white.headroom, 0.0f);
  EXPECT_EQ(white.variety, 0.0f);
  EXPECT_EQ(omitted_error(view, white), 0.0f);
  EXPECT_EQ(error_options(white).coarse_tex, white.coarse_light);
}

TEST(ViewTone, CoarseTexIsOffByWhatItsTilesWereDrawnWithWhereTheViewLooks) {
  auto picture = picture_of([](auto, auto) { return 128; });
  const auto coarse_tex = [&] { return error_options(tone_of(view_of_all(), &picture)).coarse_tex; };
  picture.errors.assign(4, 0.0f);
  const float coded = coarse_tex();
  EXPECT_GT(coded, 0.0f) << "a still picture of few bytes is not what was drawn";
  picture.errors.assign(4, 0.2f);
  EXPECT_NEAR(coarse_tex(), std::hypot(0.2f, coded), 1e-6f);
  picture.errors[1] = picture.errors[2] = picture.errors[3] = 0;
  EXPECT_NEAR(coarse_tex(), std::hypot(0.1f, coded), 1e-6f) << "a quarter of what is seen";
}

TEST(ViewTone, APlainGreyLosesNothingWhereItIsCoarser) {
  const auto view = view_of_all();
  const auto plain = picture_of([](auto, auto) { return 128; });
  const auto checks = picture_of([](auto x, auto y) { return (x + y) % 2 == 0 ? 90 : 160; });
  EXPECT_EQ(tone_of(view, &plain).variety, 0.0f);
  EXPECT_EQ(tone_of(view, &checks).variety, 1.0f);
  EXPECT_NEAR(error_options(tone_of(view, &plain)).coarse_tex, ErrorOptions{}.coarse_tex, 1e-3f) << "noise it may have";
  const std::vector<WeightedChain> chains{{{{TileId(0, 1), TileId(1, 2), kNoTile, kNoTile}}, 1.0f}};
  const std::vector<std::uint8_t> served{1};
  StoredImage stored;
  const ImageLookup images = [&](TileId) { return &stored; };
  const auto error = [&](const CoarseLuma& p) {
    return view_error(chains, served, images, 4, true, error_options(tone_of(view, &p)));
  };
  EXPECT_EQ(error(plain), 0.0f);
  EXPECT_GT(error(checks), 0.01f);
}

TEST(ViewTone, LightAroundIsWhatIsSeenOverWhatItReflects) {
  const auto view = view_of_all();
  const auto grey = picture_of([](auto, auto) { return 128; });  // linear 0.2159
  EXPECT_NEAR(tone_of(view, &grey).surroundings, 0.4317f, 1e-3f);
  const auto dim = picture_of([](auto, auto) { return 60; });
  EXPECT_LT(omitted_error(view, tone_of(view, &dim)), omitted_error(view, tone_of(view, &grey)));
  EXPECT_EQ(tone_of(view, nullptr).surroundings, scene::kGreySurroundings);
  EXPECT_EQ(tone_of(VisibleSet{}, &grey).surroundings, scene::kGreySurroundings);
}

TEST(ViewTone, PlacesOutsideThePictureAreReadAtItsEdge) {
  VisibleSet view;
  SampleTaps taps;
  taps.chain = view.add(Chain{}, 1);
  taps.coarse = {65535, 65535};
  view.add_taps(taps);
  const auto grey = picture_of([](auto, auto) { return 128; });
  EXPECT_NEAR(tone_of(view, &grey).brightness, 128.0f / 255, 1e-5f);
}

}  // namespace
}  // namespace darm::tile_scheduler
