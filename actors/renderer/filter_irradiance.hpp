// Removes noise from soft light while it converges: a cross-bilateral filter over irradiance, so that textures (albedo)
// stay sharp, which narrows as samples come in and vanishes at the end, so that the limit is unbiased.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace darm::renderer {

/// Widest filter, texels to each side.
inline constexpr int kMaxFilterRadius = 10;

/// A square window of texels with a margin of `radius` around the 32x32 that are filtered. Row-major, one value a
/// texel. Texels with count 0 take no part.
struct FilterWindow {
  int radius = 0;
  int size = 0;  ///< 32 + 2 * radius
  std::vector<std::uint32_t> patch;
  std::vector<float> count;                      ///< samples
  std::array<std::vector<float>, 3> irradiance;  ///< soft radiance / albedo
  std::array<std::vector<float>, 3> trust;       ///< count, or 0 in a channel whose albedo is too small to divide by
  std::vector<float> grey;                       ///< luminance of soft radiance / luminance of albedo
  std::vector<float> grey_m2;                    ///< sum of squared deviations of the samples of `grey`

  void reset(int new_radius);
};

/// Filtered texel: irradiance (0 where the channel has no trust at all) and the variance of its grey value.
struct FilteredTexel {
  std::array<float, 3> irradiance{};
  float variance = 0;
  bool known = false;
};

/// Radius needed for texels of `count` samples to reach `target` effective samples; 0 when they have them.
[[nodiscard]] int filter_radius(float count, float target);

/// Two one-dimensional passes (an approximation of the full kernel). Weights: Gaussian with the width at which count *
/// effective area = target; same patch only; likeness of the 3x3-pooled grey irradiance in units of its own standard
/// error (idea of SVGF, Schied et al. 2017, section 4.4, here from sample statistics instead of history).
/// The variance treats texels as independent. Writes 32x32 texels.
class IrradianceFilter {
 public:
  void run(const FilterWindow& window, float target, std::vector<FilteredTexel>& out);

 private:
  void pool(const FilterWindow& window);
  void prepare_weights(float target);

  struct Row {
    std::array<float, 3> irradiance{};
    std::array<float, 3> trust{};
    float variance = 0;
    float weight = 0;
  };
  std::vector<float> pooled_;           // 3x3 mean of grey
  std::vector<float> pooled_variance_;  // of that mean
  std::vector<float> texel_variance_;   // of the texel's own mean
  std::vector<Row> rows_;               // after the horizontal pass: 32 wide, size high
  std::vector<float> weights_;          // [count][distance]
  float weights_target_ = -1;
};

}  // namespace darm::renderer
