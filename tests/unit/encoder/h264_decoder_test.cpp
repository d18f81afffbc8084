#include "actors/encoder/h264_decoder.hpp"

#include <gtest/gtest.h>

#include "actors/encoder/yuv_convert.hpp"
#include "tests/unit/encoder/decode.hpp"

namespace darm::encoder {
namespace {

OwnedPicture gradient(std::uint32_t width, std::uint32_t height, bool chroma_444) {
  OwnedPicture p(width, height, chroma_444);
  for (int i = 0; i < 3; ++i)
    for (std::uint32_t y = 0; y < (i > 0 && !chroma_444 ? height / 2 : height); ++y)
      for (std::uint32_t x = 0; x < (i > 0 && !chroma_444 ? width / 2 : width); ++x)
        p.row(i, y)[x] = static_cast<std::uint8_t>(40 + x + 2 * y + 10 * static_cast<unsigned>(i));
  return p;
}

TEST(H264Decoder, GivesWhatAnyDecoderGivesForBothChromaFormats) {
  for (const bool chroma_444 : {false, true}) {
    H264Settings settings{.width = 64, .height = 48, .chroma_444 = chroma_444};
    auto encoder = H264Encoder::create(settings).value();
    auto decoder = H264Decoder::create().value();
    testing::Decoder judge;
    const auto picture = gradient(64, 48, chroma_444);
    for (int frame = 0; frame < 3; ++frame) {
      const auto packet = encoder->encode(picture.view(), frame == 0).value();
      const auto expected = judge.decode(packet);
      const auto made = decoder->decode(packet);
      ASSERT_TRUE(made) << made.error().message;
      EXPECT_EQ(made->width, 64u);
      EXPECT_EQ(made->height, 48u);
      EXPECT_EQ(made->chroma_444, chroma_444);
      for (std::size_t i = 0; i < 3; ++i)
        for (int y = 0; y < expected.plane_height[i]; ++y)
          for (int x = 0; x < expected.plane_width[i]; ++x)
            ASSERT_EQ(made->plane[i][static_cast<std::size_t>(y) * made->stride[i] + static_cast<std::size_t>(x)],
                      expected.plane[i][static_cast<std::size_t>(y * expected.plane_width[i] + x)]);
    }
  }
}

TEST(H264Decoder, DamageIsAnError) {
  auto decoder = H264Decoder::create().value();
  EXPECT_FALSE(decoder->decode({}));
  EXPECT_FALSE(decoder->decode(std::vector<std::uint8_t>(100, 0x5a)));
}

}  // namespace
}  // namespace darm::encoder
