#include "actors/encoder/yuv_convert.hpp"

#include <algorithm>

namespace darm::encoder {

OwnedPicture::OwnedPicture(std::uint32_t width, std::uint32_t height, bool chroma_444)
    : width_(width), height_(height), chroma_444_(chroma_444) {
  for (int i = 0; i < 3; ++i) {
    const bool half = i > 0 && !chroma_444;
    const std::size_t w = half ? (width + 1) / 2 : width;
    const std::size_t h = half ? (height + 1) / 2 : height;
    stride_[i] = (w + 63) / 64 * 64;
    planes_[i].assign(stride_[i] * h, 128);
  }
}

PlanarPicture OwnedPicture::view() const {
  PlanarPicture p;
  p.width = width_;
  p.height = height_;
  p.chroma_444 = chroma_444_;
  for (int i = 0; i < 3; ++i) {
    p.plane[i] = planes_[i].data();
    p.stride[i] = stride_[i];
  }
  return p;
}

OwnedPicture to_yuv420(std::span<const std::uint8_t> rgb, std::uint32_t width, std::uint32_t height) {
  const auto padded = [](std::uint32_t n) { return std::max(16u, (n + 1) / 2 * 2); };
  const std::uint32_t w = padded(width);
  const std::uint32_t h = padded(height);
  OwnedPicture out(w, h, false);
  const auto at = [&](std::uint32_t x, std::uint32_t y) {
    const std::size_t sx = std::min(x, width - 1);
    const std::size_t sy = std::min(y, height - 1);
    return rgb.data() + (sy * width + sx) * 3;
  };
  for (std::uint32_t y = 0; y < h; y += 2) {
    for (std::uint32_t x = 0; x < w; x += 2) {
      int sum[3] = {0, 0, 0};
      for (std::uint32_t k = 0; k < 4; ++k) {
        const auto* p = at(x + (k & 1), y + (k >> 1));
        for (int c = 0; c < 3; ++c) sum[c] += p[c];
        out.row(0, y + (k >> 1))[x + (k & 1)] = to_ycc(p[0], p[1], p[2]).y;
      }
      const auto mean = to_ycc((sum[0] + 2) / 4, (sum[1] + 2) / 4, (sum[2] + 2) / 4);
      out.row(1, y / 2)[x / 2] = mean.cb;
      out.row(2, y / 2)[x / 2] = mean.cr;
    }
  }
  return out;
}

}  // namespace darm::encoder
