// What the filter of soft light works on: a square of texels with all that is known of them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "actors/types/tile_id.hpp"

namespace darm::renderer {

/// Widest filter, texels to each side.
inline constexpr int kMaxFilterRadius = 10;

/// Mean samples a texel, of those that have any, under which a window is that of a first pass.
inline constexpr float kFirstPassSamples = 2;

/// FilterWindow::patch of a texel that no patch owns.
inline constexpr std::uint32_t kNoTexelPatch = 0xffffffffu;

/// FilterWindow::walls: something stands between the texel and that before it in its row, or above it in its column.
inline constexpr std::uint8_t kWallBefore = 1;
inline constexpr std::uint8_t kWallAbove = 2;

/// A square window of texels with a margin of `radius` around the 32x32 that are filtered. Row-major, one value a
/// texel. Texels with count 0 give nothing, but are given what the others of their patch (kNoTexelPatch: none) have.
struct FilterWindow {
  int radius = 0;
  int size = 0;  ///< 32 + 2 * radius
  std::vector<std::uint32_t> patch;
  std::vector<std::uint8_t> walls;               ///< kWallBefore, kWallAbove or both: between texels of the window
  std::vector<float> count;                      ///< samples
  std::array<std::vector<float>, 3> irradiance;  ///< soft light of a white surface
  std::vector<float> grey;                       ///< its luminance
  std::vector<float> grey_m2;                    ///< sum of squared deviations of the samples of `grey`
  std::vector<float> tint;   ///< what soft light is multiplied with on display (linear, exposed), luminance
  std::vector<float> floor;  ///< all other light of the texel on display (linear, exposed), luminance

  void reset(int new_radius) {
    radius = std::clamp(new_radius, 0, kMaxFilterRadius);
    size = kSlotSize + 2 * radius;
    const auto n = static_cast<std::size_t>(size * size);
    patch.assign(n, kNoTexelPatch);
    walls.assign(n, 0);
    for (auto* plane : {&count, &grey, &grey_m2, &tint, &floor}) plane->assign(n, 0.0f);
    for (auto& plane : irradiance) plane.assign(n, 0.0f);
  }
  /// So few samples that they say nothing of their own noise.
  [[nodiscard]] bool first_pass() const {
    float samples = 0, texels = 0;  // exact: whole numbers, and far under 2^24 where it matters
    for (const float n : count) {
      samples += n;
      texels += n > 0 ? 1.0f : 0.0f;
    }
    return samples < kFirstPassSamples * texels;
  }
};

}  // namespace darm::renderer
