#include "actors/renderer/display_curve.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace darm::renderer {

namespace {

constexpr int kSteps = 16384;

double linear_of(double code) { return code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4); }

struct Tables {
  std::array<float, 257> from;            // smallest linear value that rounds to this code
  std::array<std::uint8_t, kSteps> code;  // of the lower end of each step
  std::array<float, 256> slope;

  Tables() {
    from[0] = 0;
    from[256] = 2;
    for (int c = 1; c < 256; ++c) from[static_cast<std::size_t>(c)] = static_cast<float>(linear_of((c - 0.5) / 255.0));
    int c = 0;
    for (int i = 0; i < kSteps; ++i) {
      while (c < 255 && from[static_cast<std::size_t>(c) + 1] <= static_cast<float>(i) / (kSteps - 1)) ++c;
      code[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(c);
    }
    for (int i = 0; i < 256; ++i) {
      const double x = linear_of(i / 255.0);
      slope[static_cast<std::size_t>(i)] =
          static_cast<float>(x <= 0.0031308 ? 12.92 : 1.055 / 2.4 * std::pow(x, 1.0 / 2.4 - 1.0));
    }
    slope[255] = 0;
  }
};

const Tables kTables;

std::uint8_t to_byte(float x) { return static_cast<std::uint8_t>(std::clamp(x + 0.5f, 0.0f, 255.0f)); }

}  // namespace

std::uint8_t srgb_code(float linear) {
  if (!(linear > 0.0f)) return 0;
  if (linear >= 1.0f) return 255;
  std::uint8_t code = kTables.code[static_cast<std::size_t>(linear * (kSteps - 1))];
  // Steps are narrower than any code, so at most one boundary lies in between.
  if (linear >= kTables.from[static_cast<std::size_t>(code) + 1]) ++code;
  return code;
}

float srgb(float linear) {
  if (!(linear > 0.0f)) return 0;
  if (linear >= 1.0f) return 1;
  const auto code = static_cast<std::size_t>(srgb_code(linear));
  const float below = code == 0 ? 0.0f : static_cast<float>(code) - 0.5f;
  const float above = code == 255 ? 255.0f : static_cast<float>(code) + 0.5f;
  const float from = kTables.from[code];
  const float to = code == 255 ? 1.0f : kTables.from[code + 1];
  return (below + (above - below) * (linear - from) / (to - from)) * (1.0f / 255.0f);
}

float srgb_slope(std::uint8_t code) { return kTables.slope[code]; }

void convert_to_planes(TileImage& image) {
  constexpr float kR = 0.2126f;
  constexpr float kG = 0.7152f;
  constexpr float kB = 0.0722f;
  for (std::size_t i = 0; i < kSlotTexels; ++i) {
    const std::uint8_t* p = &image.rgb[i * 3];
    image.y[i] = to_byte(kR * p[0] + kG * p[1] + kB * p[2]);
  }
  constexpr std::size_t kHalf = kSlotSize / 2;
  for (std::size_t y = 0; y < kHalf; ++y)
    for (std::size_t x = 0; x < kHalf; ++x) {
      const std::size_t at = (y * 2 * kSlotSize + x * 2) * 3;
      std::array<float, 3> mean{};
      for (const std::size_t corner : {at, at + 3, at + kSlotSize * 3, at + kSlotSize * 3 + 3})
        for (std::size_t c = 0; c < 3; ++c) mean[c] += 0.25f * image.rgb[corner + c];
      const float luma = kR * mean[0] + kG * mean[1] + kB * mean[2];
      image.cb[y * kHalf + x] = to_byte((mean[2] - luma) / 1.8556f + 128.0f);
      image.cr[y * kHalf + x] = to_byte((mean[0] - luma) / 1.5748f + 128.0f);
    }
}

}  // namespace darm::renderer
