// Keeps rare bright samples from being smeared into spots while there are too few samples to average them away.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace darm::renderer {

/// Samples from which a texel is left as it is.
inline constexpr float kOutlierSamples = 1024;

/// How many times the mean of its neighbours (5x5, same patch, itself left out) a texel of `count` samples may shine:
/// 2 + 24 / count + count / 64. One sample may be many times the mean and still be what light is like there (a window
/// that one direction in twenty meets): held to twice its neighbours it costs Sponza's atrium 4 dB. In the limit
/// nothing is held down; what is held down meanwhile is shared out in the picture as far as it is to be trusted
/// (LostLight), and the store knows nothing of it.
[[nodiscard]] float outlier_bound(float count);

/// Soft light of a square of texels, row-major: what outliers are judged by.
struct LightSquare {
  int size = 0;
  std::vector<std::uint32_t> patch;
  std::vector<float> count;  ///< samples; 0: says nothing
  std::vector<float> grey;   ///< luminance of their mean

  void reset(int new_size);
};

/// The texel at `at` of a LightSquare is `scale`, 0..1, times as bright as it would be.
struct Outlier {
  std::size_t at = 0;
  float scale = 1;
};

/// Texels brighter than their bound, in order. Of a texel too few of whose neighbours have samples nothing is said.
void find_outliers(const LightSquare& square, std::vector<Outlier>& found);

}  // namespace darm::renderer
