#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "actors/encoder/phystex_picture.hpp"
#include "actors/encoder/yuv_convert.hpp"

namespace darm::encoder {
namespace {

TEST(ToYcc, keeps_greys_grey) {
  for (int v = 0; v < 256; ++v) {
    const auto c = to_ycc(v, v, v);
    EXPECT_EQ(c.y, v);
    EXPECT_EQ(c.cb, 128);
    EXPECT_EQ(c.cr, 128);
  }
}

TEST(ToYcc, is_the_bt709_matrix_within_one_level) {
  for (int r = 0; r < 256; r += 15) {
    for (int g = 0; g < 256; g += 15) {
      for (int b = 0; b < 256; b += 15) {
        const double y = .2126 * r + .7152 * g + .0722 * b;
        const auto c = to_ycc(r, g, b);
        EXPECT_NEAR(c.y, y, .51);
        EXPECT_NEAR(c.cb, std::min(255.0, 128 + (b - y) / 1.8556), .52);
        EXPECT_NEAR(c.cr, std::min(255.0, 128 + (r - y) / 1.5748), .52);
      }
    }
  }
}

TEST(ToYuv420, pads_by_repeating_and_averages_chroma) {
  std::vector<std::uint8_t> rgb(17 * 3 * 3, 0);
  for (std::size_t i = 0; i < rgb.size(); i += 3) rgb[i] = 255;
  const auto picture = to_yuv420(rgb, 17, 3);
  const auto view = picture.view();
  EXPECT_EQ(view.width, 18u);
  EXPECT_EQ(view.height, 16u);
  const auto red = to_ycc(255, 0, 0);
  EXPECT_EQ(view.plane[0][17 + 15 * view.stride[0]], red.y);
  EXPECT_EQ(view.plane[1][8 + 7 * view.stride[1]], red.cb);
  EXPECT_EQ(view.plane[2][0], red.cr);
}

TEST(PhysTexPicture, writes_its_slot_and_nothing_else) {
  for (const bool chroma_444 : {false, true}) {
    PhysTexPicture picture(128, chroma_444);
    TileImage image;
    for (std::size_t i = 0; i < image.y.size(); ++i) image.y[i] = static_cast<std::uint8_t>(i % 251);
    image.cb.fill(10);
    image.cr.fill(20);
    image.rgb.fill(77);
    ASSERT_TRUE(picture.write(6, image));  // row 1, column 2
    const auto view = picture.view();
    for (std::uint32_t y = 0; y < 128; ++y) {
      for (std::uint32_t x = 0; x < 128; ++x) {
        const bool inside = y / 32 == 1 && x / 32 == 2;
        ASSERT_EQ(view.plane[0][y * view.stride[0] + x], inside ? image.y[(y % 32) * 32 + x % 32] : 128);
      }
    }
    const std::uint32_t half = chroma_444 ? 1 : 2;
    for (std::uint32_t y = 0; y < 128 / half; ++y) {
      for (std::uint32_t x = 0; x < 128 / half; ++x) {
        const bool inside = y * half / 32 == 1 && x * half / 32 == 2;
        const int cb = inside && !chroma_444 ? 10 : 128;  // 4:4:4 takes it from rgb, which is grey
        ASSERT_EQ(view.plane[1][y * view.stride[1] + x], cb);
      }
    }
  }
}

TEST(PhysTexPicture, refuses_a_slot_it_does_not_have) {
  PhysTexPicture picture(64, false);
  EXPECT_TRUE(picture.write(3, TileImage{}));
  EXPECT_FALSE(picture.write(4, TileImage{}));
  EXPECT_FALSE(picture.write(kNoSlot, TileImage{}));
}

}  // namespace
}  // namespace darm::encoder
