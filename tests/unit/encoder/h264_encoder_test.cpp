#include "actors/encoder/h264_encoder.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "actors/encoder/phystex_picture.hpp"
#include "actors/encoder/yuv_convert.hpp"
#include "tests/unit/encoder/decode.hpp"

namespace darm::encoder {
namespace {

using testing::Decoder;

H264Settings settings(std::uint32_t size, bool chroma_444 = false) {
  H264Settings s;
  s.width = size;
  s.height = size;
  s.chroma_444 = chroma_444;
  return s;
}

std::unique_ptr<H264Encoder> make(const H264Settings& s) { return H264Encoder::create(s).value(); }

// Each slot one flat colour of its own.
OwnedPicture flat_slots(std::uint32_t size, bool chroma_444) {
  OwnedPicture p(size, size, chroma_444);
  for (int i = 0; i < 3; ++i) {
    const std::uint32_t slot = (i > 0 && !chroma_444) ? 16 : 32;
    const std::uint32_t side = (i > 0 && !chroma_444) ? size / 2 : size;
    for (std::uint32_t y = 0; y < side; ++y) {
      for (std::uint32_t x = 0; x < side; ++x) {
        const auto n = (y / slot) * 7u + (x / slot) * 13u + static_cast<unsigned>(i) * 5u;
        p.row(i, y)[x] = static_cast<std::uint8_t>(i == 0 ? 16 + n * 29 % 224 : 96 + n * 11 % 64);
      }
    }
  }
  return p;
}

// Largest difference in the middle of the slots, where the client's taps of a flat tile read.
int worst_inside(const testing::DecodedPicture& got, const PlanarPicture& want) {
  int worst = 0;
  for (int i = 0; i < 3; ++i) {
    const int slot = got.plane_width[i] < got.width ? 16 : 32;
    for (int y = 0; y < got.plane_height[i]; ++y) {
      for (int x = 0; x < got.plane_width[i]; ++x) {
        if (x % slot == 0 || x % slot == slot - 1 || y % slot == 0 || y % slot == slot - 1) continue;
        const int a = got.plane[i][static_cast<std::size_t>(y * got.plane_width[i] + x)];
        const int b = want.plane[i][static_cast<std::size_t>(y) * want.stride[i] + static_cast<std::size_t>(x)];
        worst = std::max(worst, std::abs(a - b));
      }
    }
  }
  return worst;
}

TEST(H264Encoder, flat_tiles_come_back_within_one_level) {
  for (const bool chroma_444 : {false, true}) {
    const auto picture = flat_slots(512, chroma_444);
    auto encoder = make(settings(512, chroma_444));
    Decoder decoder;
    const auto got = decoder.decode(encoder->encode(picture.view(), true).value());
    EXPECT_LE(worst_inside(got, picture.view()), 1) << "4:4:4: " << chroma_444;
  }
}

TEST(H264Encoder, signals_its_colours) {
  const auto picture = flat_slots(256, false);
  Decoder decoder;
  const auto got = decoder.decode(make(settings(256))->encode(picture.view(), true).value());
  EXPECT_EQ(got.range, AVCOL_RANGE_JPEG);
  EXPECT_EQ(got.matrix, AVCOL_SPC_BT709);
  EXPECT_EQ(got.primaries, AVCOL_PRI_BT709);
  EXPECT_EQ(got.transfer, AVCOL_TRC_IEC61966_2_1);
  EXPECT_EQ(got.chroma_location, AVCHROMA_LOC_CENTER);
  EXPECT_EQ(got.profile, FF_PROFILE_H264_HIGH);
  EXPECT_EQ(got.width, 256);
}

TEST(H264Encoder, keeps_full_chroma_when_asked) {
  const auto picture = flat_slots(256, true);
  Decoder decoder;
  const auto got = decoder.decode(make(settings(256, true))->encode(picture.view(), true).value());
  EXPECT_EQ(got.plane_width[1], 256);
  EXPECT_EQ(got.plane_height[2], 256);
  EXPECT_EQ(got.range, AVCOL_RANGE_JPEG);
  EXPECT_EQ(got.profile, FF_PROFILE_H264_HIGH_444_PREDICTIVE);
}

TEST(H264Encoder, makes_key_frames_when_asked_and_only_then) {
  const auto picture = flat_slots(256, false);
  auto encoder = make(settings(256));
  Decoder decoder;
  for (int i = 0; i < 300; ++i) {
    const bool want = i == 0 || i == 7;
    const auto bytes = encoder->encode(picture.view(), want).value();
    ASSERT_EQ(decoder.decode(bytes).key, want) << "frame " << i;
  }
}

TEST(H264Encoder, a_late_key_frame_stands_alone) {
  const auto picture = flat_slots(256, false);
  auto encoder = make(settings(256));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(encoder->encode(picture.view(), false).has_value());
  Decoder late;
  const auto got = late.decode(encoder->encode(picture.view(), true).value());
  EXPECT_LE(worst_inside(got, picture.view()), 1);
}

TEST(H264Encoder, the_first_frame_is_a_key_frame_even_if_not_asked) {
  const auto picture = flat_slots(256, false);
  Decoder decoder;
  EXPECT_TRUE(decoder.decode(make(settings(256))->encode(picture.view(), false).value()).key);
}

TEST(H264Encoder, lower_quality_takes_fewer_bytes) {
  PhysTexPicture noise(512, false);
  std::uint32_t state = 1;
  for (SlotIndex slot = 0; slot < noise.slot_count(); ++slot) {
    TileImage image;
    for (auto& y : image.y) y = static_cast<std::uint8_t>((state = state * 1664525u + 1013904223u) >> 24);
    image.cb.fill(120);
    image.cr.fill(130);
    ASSERT_TRUE(noise.write(slot, image));
  }
  auto encoder = make(settings(512));
  const auto fine = encoder->encode(noise.view(), true).value().size();
  encoder->set_crf(40);
  EXPECT_LT(encoder->encode(noise.view(), true).value().size(), fine / 2);
}

TEST(H264Encoder, a_still_picture_comes_nearer_as_quality_rises) {
  PhysTexPicture grain(256, false);
  std::uint32_t state = 1;
  for (SlotIndex slot = 0; slot < grain.slot_count(); ++slot) {
    TileImage image;
    for (auto& y : image.y) y = static_cast<std::uint8_t>(100 + ((state = state * 1664525u + 1013904223u) >> 27));
    image.cb.fill(120);
    image.cr.fill(130);
    ASSERT_TRUE(grain.write(slot, image));
  }
  auto encoder = make(settings(256));
  Decoder decoder;
  const auto off = [&](bool key) {
    const auto shown = decoder.decode(encoder->encode(grain.view(), key).value());
    double squares = 0;
    for (std::size_t i = 0; i < shown.plane[0].size(); ++i)
      squares += std::pow(double(shown.plane[0][i]) - double(grain.view().plane[0][i]), 2);
    return std::sqrt(squares / static_cast<double>(shown.plane[0].size()));
  };
  const double first = off(true);
  double last = off(false);
  for (int crf = 16; crf >= 8; crf -= 2) {
    encoder->set_crf(static_cast<float>(crf));
    last = off(false);
  }
  EXPECT_LT(last, 0.5 * first);
}

TEST(H264Encoder, falls_back_to_libx264) {
  auto s = settings(256);
  s.codec = "no_such_encoder";
  EXPECT_EQ(make(s)->codec_name(), "libx264");
}

TEST(H264Encoder, refuses_what_it_cannot_encode) {
  EXPECT_FALSE(H264Encoder::create(settings(0)).has_value());
  EXPECT_FALSE(H264Encoder::create(settings(257)).has_value());
  auto s = settings(256);
  s.crf = std::nanf("");
  EXPECT_FALSE(H264Encoder::create(s).has_value());
  s = settings(256);
  s.preset = "nonsense";
  EXPECT_FALSE(H264Encoder::create(s).has_value());
  const auto other = flat_slots(128, false);
  EXPECT_FALSE(make(settings(256))->encode(other.view(), true).has_value());
}

TEST(H264Encoder, the_largest_picture_gets_a_level_that_allows_it) {
  const OwnedPicture picture(4096, 4096, false);
  Decoder decoder;
  const auto got = decoder.decode(make(settings(4096))->encode(picture.view(), true).value());
  EXPECT_GE(got.level, 60);
  EXPECT_EQ(got.width, 4096);
}

}  // namespace
}  // namespace darm::encoder
