#include "actors/encoder/coarse_still.hpp"

#include "actors/encoder/h264_encoder.hpp"
#include "actors/encoder/yuv_convert.hpp"

namespace darm::encoder {

Result<std::shared_ptr<const session::CoarseTexture>> encode_coarse(const CoarsePicture& picture,
                                                                    const CoarseStillOptions& options) {
  const std::size_t pixels = std::size_t{picture.width} * picture.height;
  if (pixels == 0 || picture.width > 8192 || picture.height > 8192 || picture.rgb.size() != pixels * 3) {
    return fail("coarse picture: size and pixels do not agree, or a side is not within 1..8192");
  }
  const auto yuv = to_yuv420(picture.rgb, picture.width, picture.height);
  H264Settings settings;
  settings.width = yuv.view().width;
  settings.height = yuv.view().height;
  settings.preset = "medium";
  settings.crf = options.crf;
  auto made = H264Encoder::create(settings);
  if (!made) return std::unexpected(made.error());
  auto texture = std::make_shared<session::CoarseTexture>();
  texture->version = picture.version;
  texture->width = picture.width;
  texture->height = picture.height;
  for (float crf = options.crf;; crf += 4) {
    (*made)->set_crf(crf);
    auto bytes = (*made)->encode(yuv.view(), true);
    if (!bytes) return std::unexpected(bytes.error());
    texture->h264 = std::move(*bytes);
    if (texture->h264.size() <= options.max_bytes || crf + 4 > 46) break;
  }
  return std::shared_ptr<const session::CoarseTexture>(std::move(texture));
}

}  // namespace darm::encoder
