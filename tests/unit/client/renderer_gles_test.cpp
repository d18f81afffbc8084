#include "client/core/renderer_gles.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstdlib>

#include "client/core/egl_context.hpp"
#include "client/core/shaders.hpp"
#include "tests/unit/client/synthetic.hpp"

namespace darm::client {
namespace {

using synthetic::Colour;

// Neighbouring texels far apart, so that a wrong tap shows.
Colour noise(std::uint32_t level, int x, int y) {
  std::uint32_t h = static_cast<std::uint32_t>(x + 7) * 0x9e3779b1u ^ static_cast<std::uint32_t>(y + 7) * 0x85ebca77u ^
                    level * 0xc2b2ae3du;
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h ^= h >> 13;
  return {static_cast<std::uint8_t>(64 + h % 128), static_cast<std::uint8_t>(64 + (h >> 8) % 128),
          static_cast<std::uint8_t>(64 + (h >> 16) % 128)};
}

Colour by_level(std::uint32_t level, int, int) {
  const Colour colours[] = {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}};
  return colours[level];
}

class RendererGles : public ::testing::Test {
 protected:
  void SetUp() override {
    auto made = EglContext::create();
    if (!made) GTEST_SKIP() << made.error().message;
    context_ = std::move(*made);
  }

  void build(const wire::SceneManifest& manifest, const wire::GeometryChunk& chunk = synthetic::square_chunk()) {
    auto scene = SceneModel::from_manifest(manifest);
    ASSERT_TRUE(scene) << scene.error().message;
    scene_.emplace(std::move(*scene));
    const auto added = scene_->add_chunk(chunk);
    ASSERT_TRUE(added) << added.error().message;
    const StreamShape shape{256, false, true};
    auto player = StreamPlayer::create(*scene_, shape);
    ASSERT_TRUE(player) << player.error().message;
    player_.emplace(std::move(*player));
    auto renderer = GlesRenderer::create(*scene_, shape);
    ASSERT_TRUE(renderer) << renderer.error().message;
    renderer_ = std::move(*renderer);
  }

  Image8 draw(const View& view) {
    const auto synced = renderer_->synchronise(*scene_, *player_);
    EXPECT_TRUE(synced) << synced.error().message;
    const auto drawn = renderer_->draw(*scene_, view);
    EXPECT_TRUE(drawn) << drawn.error().message;
    auto image = renderer_->read_picture();
    EXPECT_TRUE(image);
    return *image;
  }

  // The same of the private layer, in another place of a PhysTex of its own.
  void apply_view(wire::StreamFrame frame, const Colour& through = {0, 0, 0}) {
    auto player = StreamPlayer::create(*scene_, StreamShape{512, false, true});
    ASSERT_TRUE(player) << player.error().message;
    if (through != Colour{0, 0, 0}) {
      std::string tile;
      for (int i = 0; i < 1024; ++i)
        tile.append({static_cast<char>(through[0]), static_cast<char>(through[1]), static_cast<char>(through[2])});
      std::string packed(compressBound(tile.size()), '\0');
      uLongf size = packed.size();
      compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(tile.data()),
               tile.size());
      packed.resize(size);
      for (auto& edit : *frame.mutable_page_edits()) edit.set_through(packed);
    }
    const auto fate = player->apply(frame, *scene_);
    ASSERT_TRUE(fate) << fate.error().message;
    const auto synced = renderer_->synchronise_view(*scene_, *player);
    ASSERT_TRUE(synced) << synced.error().message;
  }

  void apply(const wire::StreamFrame& frame) {
    const auto fate = player_->apply(frame, *scene_);
    ASSERT_TRUE(fate) << fate.error().message;
    ASSERT_EQ(*fate, FrameFate::kApplied);
  }

  static Colour pixel(const Image8& i, std::uint32_t x, std::uint32_t y) {
    const auto* p = i.rgb.data() + (std::size_t{y} * i.width + x) * 3;
    return {p[0], p[1], p[2]};
  }

  std::unique_ptr<EglContext> context_;
  std::optional<SceneModel> scene_;
  std::optional<StreamPlayer> player_;
  std::unique_ptr<GlesRenderer> renderer_;
};

// Looks straight at the square, which fills the picture: 2 units over `size` pixels.
View frontal(std::uint32_t size) { return look_at({1, 1, 1}, {1, 1, 0}, 90, size, size); }

double bilinear(double x, double y, std::size_t channel) {
  const int ix = static_cast<int>(std::floor(x - 0.5)), iy = static_cast<int>(std::floor(y - 0.5));
  const double fx = x - 0.5 - ix, fy = y - 0.5 - iy;
  const auto at = [&](int i, int j) { return noise(0, i, j)[channel] / 255.0; };
  return (at(ix, iy) * (1 - fx) + at(ix + 1, iy) * fx) * (1 - fy) +
         (at(ix, iy + 1) * (1 - fx) + at(ix + 1, iy + 1) * fx) * fy;
}

TEST_F(RendererGles, FiltersAcrossTileBordersLikeTheWholeAtlas) {
  build(synthetic::manifest());
  apply(synthetic::key_frame(noise, 0, 2));
  constexpr std::uint32_t size = 256;
  const Image8 image = draw(frontal(size));
  int worst = 0;
  for (std::uint32_t y = 0; y < size; ++y) {
    for (std::uint32_t x = 0; x < size; ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        double sum = 0;
        for (int s = 0; s < 4; ++s) {
          const double u = (x + 0.25 + 0.5 * (s & 1)) * 2 / size, v = 2 - (y + 0.25 + 0.5 * (s >> 1)) * 2 / size;
          sum += srgb_to_linear(static_cast<float>(bilinear(10.5 + u * 32, 10.5 + v * 32, c)));
        }
        const double expected = 255 * linear_to_srgb(static_cast<float>(sum / 4));
        worst = std::max(worst, static_cast<int>(std::lround(std::abs(expected - pixel(image, x, y)[c]))));
      }
    }
  }
  EXPECT_LE(worst, 2);
}

TEST_F(RendererGles, TakesTheLevelOfTheMinorFootprint) {
  build(synthetic::manifest());
  apply(synthetic::key_frame(by_level, 0, 2));
  // Near and far enough for more than one level in one picture.
  const View view = look_at({1, -0.6, 0.8}, {1, 1, 0}, 60, 40, 40);
  const Image8 image = draw(view);
  const glm::dmat4 to_clip = projection_matrix(view, 0.01, 100, false) * view_matrix(view, {0, 0, 0});
  const glm::dmat4 back = glm::inverse(to_clip);
  const auto uv_at = [&](double sx, double sy) {
    glm::dvec4 a = back * glm::dvec4(sx / 40 * 2 - 1, 1 - sy / 40 * 2, -1, 1),
               b = back * glm::dvec4(sx / 40 * 2 - 1, 1 - sy / 40 * 2, 1, 1);
    a /= a.w;
    b /= b.w;
    const double t = a.z / (a.z - b.z);
    return glm::dvec2(a + (b - a) * t);
  };
  int compared = 0, different = 0;
  std::array<int, 3> seen{};
  for (std::uint32_t y = 0; y < 40; ++y) {
    for (std::uint32_t x = 0; x < 40; ++x) {
      const Colour c = pixel(image, x, y);
      const int level = c == Colour{255, 0, 0} ? 0 : c == Colour{0, 255, 0} ? 1 : c == Colour{0, 0, 255} ? 2 : -1;
      const glm::dvec2 p = uv_at(x + 0.25, y + 0.75);
      if (p.x < 0.05 || p.y < 0.05 || p.x > 1.95 || p.y > 1.95) continue;
      const glm::dvec2 dx = (uv_at(x + 0.75, y + 0.75) - p) * 64.0, dy = (uv_at(x + 0.25, y + 0.25) - p) * 64.0;
      const float fx[2] = {static_cast<float>(dx.x), static_cast<float>(dx.y)},
                  fy[2] = {static_cast<float>(dy.x), static_cast<float>(dy.y)};
      const int wanted = sharp_level(fx, fy, 3);
      ++compared;
      ++seen[static_cast<std::size_t>(wanted)];
      different += level != wanted;
    }
  }
  EXPECT_GT(compared, 400);
  EXPECT_GT(seen[0], 0);
  EXPECT_GT(seen[1], 0);
  EXPECT_LE(different, compared / 50) << "of " << compared;
}

TEST_F(RendererGles, WalksToCoarserLevelsAndCountsThem) {
  build(synthetic::manifest());
  apply(synthetic::key_frame(by_level, 1, 1));
  const Image8 image = draw(frontal(128));
  EXPECT_EQ(pixel(image, 64, 64), (Colour{0, 255, 0}));
  const auto counts = renderer_->count_residency(*scene_, frontal(128));
  ASSERT_TRUE(counts);
  EXPECT_EQ(counts->samples, 256u * 256u);
  EXPECT_EQ(counts->coarser, counts->samples);
}

TEST_F(RendererGles, ShowsGreyAndSaysUndefinedBeforeAnyLight) {
  build(synthetic::manifest());
  const Image8 image = draw(frontal(64));
  EXPECT_NEAR(pixel(image, 32, 32)[0], 0x80, 1);
  const auto counts = renderer_->count_residency(*scene_, frontal(64));
  ASSERT_TRUE(counts);
  EXPECT_EQ(counts->undefined, counts->samples);
}

TEST_F(RendererGles, DrawsTheSkyByDirectionBlendedInLinearLight) {
  build(synthetic::manifest());
  const Image8 up = draw(look_at({1, 1, 5}, {1, 101, 5}, 10, 33, 33));
  EXPECT_NEAR(pixel(up, 16, 16)[0], 0x40, 1);
  EXPECT_NEAR(pixel(up, 16, 16)[2], 0xff, 1);
  const Image8 slanted = draw(look_at({1, 1, 5}, {1, 2, 5 + std::sqrt(3.0)}, 1, 33, 33));  // direction.y = 0.5
  const float expected = linear_to_srgb(0.5f * (srgb_to_linear(0x40 / 255.f) + srgb_to_linear(0x80 / 255.f)));
  EXPECT_NEAR(pixel(slanted, 16, 16)[0], 255 * expected, 1.5);
  const Image8 down = draw(look_at({1, 1, 5}, {1, -99, 6}, 10, 33, 33));
  EXPECT_NEAR(pixel(down, 16, 16)[0], 0x40, 1);
  EXPECT_NEAR(pixel(down, 16, 16)[2], 0x10, 1);
}

// White is where the light is, not where three clamped numbers are blended.
TEST_F(RendererGles, ASkyBrighterThanWhiteIsClampedWhereItIsSeen) {
  auto manifest = synthetic::manifest();
  for (int c = 0; c < 3; ++c) {
    manifest.set_sky(c, c == 2 ? 4.0f : 0.25f);  // zenith: blue beyond white
    manifest.set_sky(3 + c, 0.25f);
  }
  build(manifest);
  const Colour c = pixel(draw(look_at({1, 1, 5}, {1, 2, 5 + std::sqrt(3.0)}, 1, 33, 33)), 16, 16);  // direction.y = 0.5
  EXPECT_NEAR(c[0], 255 * linear_to_srgb(0.25f), 1.5);
  EXPECT_EQ(c[2], 255) << "half way to 4 is 2.1; to 1 it would be .6";
}

TEST_F(RendererGles, LooksThroughTheBackOfASingleSidedInstance) {
  auto manifest = synthetic::manifest();
  manifest.mutable_instances(0)->set_camera_sees_back(false);
  build(manifest);
  apply(synthetic::key_frame(by_level, 0, 2));
  EXPECT_EQ(pixel(draw(frontal(64)), 32, 32), (Colour{255, 0, 0}));
  const Colour behind = pixel(draw(look_at({1, 1, -1}, {1, 1, 0}, 90, 64, 64)), 32, 32);
  EXPECT_NE(behind, (Colour{255, 0, 0}));
}

TEST_F(RendererGles, MirroredInstanceShowsItsFront) {
  auto manifest = synthetic::manifest();
  auto& instance = *manifest.mutable_instances(0);
  instance.set_camera_sees_back(false);
  instance.set_flipped(true);
  instance.set_to_world(0, -1);
  instance.set_to_world(12, 2);  // x -> 2 - x
  build(manifest);
  apply(synthetic::key_frame(by_level, 0, 2));
  // The winding is reversed in the world; `flipped` swaps it back, so the front still looks to +z.
  EXPECT_EQ(pixel(draw(frontal(64)), 32, 32), (Colour{255, 0, 0}));
}

TEST_F(RendererGles, ThinClearSurfacesTintWhatIsBehindInLinearLight) {
  auto manifest = synthetic::manifest();
  auto pane = synthetic::instance_at(0, 0, 0.25f);
  pane.set_transmission(0.5f);
  pane.set_tint_rgb(0xff0000);
  *manifest.add_instances() = pane;
  build(manifest);
  apply(synthetic::key_frame([](std::uint32_t, int, int) { return Colour{100, 100, 100}; }, 0, 2));
  const Colour c = pixel(draw(frontal(64)), 32, 32);
  const float own = srgb_to_linear(100 / 255.f);
  EXPECT_NEAR(c[0], 255 * linear_to_srgb(own * 1.5f), 2);
  EXPECT_NEAR(c[1], 100, 2);
}

TEST_F(RendererGles, AddsThePrivateLayerInLinearLightWhereThereIsOne) {
  build(synthetic::manifest());
  apply(synthetic::key_frame([](std::uint32_t, int, int) { return Colour{100, 60, 255}; }, 0, 2));
  const Colour before = pixel(draw(frontal(64)), 32, 32);
  EXPECT_EQ(before, (Colour{100, 60, 255}));
  apply_view(synthetic::key_frame([](std::uint32_t, int, int) { return Colour{120, 0, 90}; }, 1, 1, 40));
  const Colour c = pixel(draw(frontal(64)), 32, 32);
  const auto linear = [](int code) { return srgb_to_linear(static_cast<float>(code) / 255.f); };
  EXPECT_NEAR(c[0], 255 * linear_to_srgb(linear(100) + linear(120)), 1.5);
  EXPECT_NEAR(c[1], 60, 1);
  EXPECT_EQ(c[2], 255) << "as bright as the display can be";
  // Another private stream takes its place: nothing is left of the first.
  apply_view(synthetic::key_frame([](std::uint32_t, int, int) { return Colour{0, 0, 0}; }, 2, 2, 7));
  EXPECT_NEAR(pixel(draw(frontal(64)), 32, 32)[1], 60, 1);
}

TEST_F(RendererGles, DimsSharedLightByFresnelsTermWhereItsReflectionIsPrivate) {
  auto manifest = synthetic::manifest();
  manifest.mutable_instances(0)->set_f0(0.04f);
  build(manifest);
  apply(synthetic::key_frame([](std::uint32_t, int, int) { return Colour{100, 100, 100}; }, 0, 2));
  apply_view(synthetic::key_frame([](std::uint32_t, int, int) { return Colour{0, 0, 0}; }, 2, 2));
  const float shared = srgb_to_linear(100 / 255.f);
  EXPECT_NEAR(pixel(draw(look_at({1, 1, 1}, {1, 1, 0}, 5, 33, 33)), 16, 16)[0], 255 * linear_to_srgb(1.05f * shared),
              1.5);
  const double slope = 0.1;
  const Colour grazing = pixel(draw(look_at({1, -2, slope * 3}, {1, 1, 0}, 2, 33, 33)), 16, 16);
  const double m = 1 - slope / std::hypot(1.0, slope);
  EXPECT_NEAR(grazing[0], 255 * linear_to_srgb(static_cast<float>(1.05 * (1 - std::pow(m, 5))) * shared), 2);
}

TEST_F(RendererGles, ClearSurfacesPassWhatTheirPrivateTilesSayAndAddTheirReflection) {
  auto manifest = synthetic::manifest();
  auto pane = synthetic::instance_at(0, 0, 0.25f);
  pane.set_transmission(1.0f);
  pane.set_f0(0.04f);
  *manifest.add_instances() = pane;
  build(manifest);
  apply(synthetic::key_frame([](std::uint32_t, int, int) { return Colour{150, 150, 150}; }, 0, 2));
  apply_view(synthetic::key_frame([](std::uint32_t, int, int) { return Colour{80, 80, 80}; }, 0, 2), {255, 128, 0});
  const Colour c = pixel(draw(look_at({1, 1, 1}, {1, 1, 0}, 5, 33, 33)), 16, 16);
  // One patch serves both: wall and pane have the same shared and private light. Only the pane has f0 and passes light.
  const float shared = srgb_to_linear(150 / 255.f), own = srgb_to_linear(80 / 255.f);
  const auto expected = [&](float through) {
    return 255 * linear_to_srgb(std::min(1.0f, 1.05f * shared + own + 0.96f * through * (shared + own)));
  };
  EXPECT_NEAR(c[0], expected(1), 2);
  EXPECT_NEAR(c[1], expected(srgb_to_linear(128 / 255.f)), 2);
  EXPECT_NEAR(c[2], expected(0), 2) << "what blurs is opaque";
}

TEST_F(RendererGles, CoverageCutsMaskedAndFadesBlendedSurfaces) {
  for (const std::uint32_t mode : {1u, 2u}) {
    auto manifest = synthetic::manifest();
    manifest.mutable_instances(0)->set_alpha_mode(mode);
    manifest.mutable_instances(0)->set_alpha_cutoff(0.5f);
    build(manifest);
    auto frame = synthetic::key_frame([](std::uint32_t, int, int) { return Colour{255, 255, 255}; }, 0, 2);
    std::string coverage(1024, '\x40');  // a quarter
    std::string packed(compressBound(1024), '\0');
    uLongf size = packed.size();
    ASSERT_EQ(
        compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(coverage.data()), 1024),
        Z_OK);
    packed.resize(size);
    for (auto& edit : *frame.mutable_page_edits()) edit.set_coverage(packed);
    apply(frame);
    const Colour c = pixel(draw(frontal(64)), 32, 20);
    const float behind = srgb_to_linear(0x80 / 255.f);
    const Colour sky = pixel(draw(look_at({1, 1, 1}, {1, 1, 0}, 90, 64, 64)), 32, 20);
    EXPECT_EQ(c, sky);
    if (mode == 1) {
      EXPECT_LT(c[0], 0x84);  // nothing of the white surface is left
    } else {
      EXPECT_GT(c[0], 255 * linear_to_srgb(0.25f));
      EXPECT_LT(c[0], 255 * linear_to_srgb(0.25f + 0.75f * behind) + 4);
    }
  }
}

// A tile that is cut away as a whole is seen by no ray, so it never gets a slot.
TEST_F(RendererGles, WhatHasNoSlotIsCutByTheCoverageOfCoarseTex) {
  for (const char alpha : {'\x00', '\xff'}) {
    auto manifest = synthetic::manifest();
    manifest.mutable_instances(0)->set_alpha_mode(1);
    manifest.mutable_instances(0)->set_alpha_cutoff(0.5f);
    manifest.set_coarse_coverage(synthetic::deflate(std::string(std::size_t{30} * 30, alpha)));
    synthetic::set_sky(manifest, 0x4060ff, 0, 0x402010);
    build(manifest);
    const auto view = look_at({1, 1, 1}, {1, 1, 0}, 90, 64, 64);
    const Image8 image = draw(view);  // nothing has come yet
    const auto counts = renderer_->count_residency(*scene_, view);
    ASSERT_TRUE(counts);
    EXPECT_EQ(counts->background == counts->samples, alpha == 0) << "samples that show the sky: " << counts->background;
  }
}

// Two sheets back to back, the one seen from its front nearer: in whatever order the file has them.
TEST_F(RendererGles, TheFarSideOfABlendedBodyLiesUnderItsNearOne) {
  for (const bool near_first : {false, true}) {
    auto manifest = synthetic::manifest();
    manifest.mutable_instances(0)->set_alpha_mode(2);
    synthetic::set_sky(manifest, 0, 0, 0);
    build(manifest, synthetic::two_sheets(near_first));
    auto frame = synthetic::key_frame(
        [](std::uint32_t level, int x, int) {
          const int half = static_cast<int>(synthetic::kOrigin[level]) + (static_cast<int>(synthetic::kQ) >> level);
          return x < half ? Colour{255, 0, 0} : Colour{0, 0, 255};
        },
        0, 2);
    for (auto& edit : *frame.mutable_page_edits()) edit.set_coverage(synthetic::deflate(std::string(1024, '\x80')));
    apply(frame);
    const Colour c = pixel(draw(look_at({1, 1, 3}, {1, 1, 0}, 5, 33, 33)), 16, 16);
    EXPECT_NEAR(c[0], 255 * linear_to_srgb(0.5f), 3) << near_first;
    EXPECT_NEAR(c[2], 255 * linear_to_srgb(0.25f), 3) << near_first;
  }
}

TEST_F(RendererGles, ReferenceDrawIsTheSameTwice) {
  build(synthetic::manifest());
  apply(synthetic::key_frame(noise, 0, 2));
  EXPECT_EQ(draw(frontal(64)).rgb, draw(frontal(64)).rgb);
}

}  // namespace
}  // namespace darm::client
