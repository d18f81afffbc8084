// sRGB-encoded RGB to full-range BT.709 YCbCr, integer arithmetic.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "actors/encoder/h264_encoder.hpp"

namespace darm::encoder {

struct Ycc {
  std::uint8_t y, cb, cr;
};

/// BT.709 matrix, full range: Y = .2126 R + .7152 G + .0722 B, Cb = 128 + (B - Y) / 1.8556, Cr = 128 + (R - Y)
/// / 1.5748, rounded to nearest.
[[nodiscard]] inline Ycc to_ycc(int r, int g, int b) {
  // 16-bit fixed point; each row sums to 65536 (Y) or to 0 (Cb, Cr), so that greys stay grey.
  const int y = (13933 * r + 46871 * g + 4732 * b + 32768) >> 16;
  const int cb = (-7509 * r - 25259 * g + 32768 * b + (128 << 16) + 32767) >> 16;
  const int cr = (32768 * r - 29763 * g - 3005 * b + (128 << 16) + 32767) >> 16;
  return {static_cast<std::uint8_t>(y), static_cast<std::uint8_t>(cb), static_cast<std::uint8_t>(cr)};
}

/// A picture that owns its planes. Strides are multiples of 64 bytes.
class OwnedPicture {
 public:
  /// Mid-grey. Sides 1..16384, even unless `chroma_444`.
  OwnedPicture(std::uint32_t width, std::uint32_t height, bool chroma_444);

  [[nodiscard]] std::uint8_t* row(int plane, std::uint32_t y) {
    return planes_[plane].data() + static_cast<std::size_t>(y) * stride_[plane];
  }
  [[nodiscard]] std::size_t stride(int plane) const { return stride_[plane]; }
  [[nodiscard]] PlanarPicture view() const;

 private:
  std::uint32_t width_;
  std::uint32_t height_;
  bool chroma_444_;
  std::size_t stride_[3];
  std::vector<std::uint8_t> planes_[3];
};

/// RGB (row-major, interleaved, width * height * 3 bytes) as 4:2:0 with centre-sited chroma: each chroma sample is the
/// mean of its 2x2 block. Sides are padded to the next even number, at least 16, by repeating the last column and row.
[[nodiscard]] OwnedPicture to_yuv420(std::span<const std::uint8_t> rgb, std::uint32_t width, std::uint32_t height);

}  // namespace darm::encoder
