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
/// texel. Texels with count 0 give nothing, but are given what the others of their patch (0xffffffff: none) have.
struct FilterWindow {
  int radius = 0;
  int size = 0;  ///< 32 + 2 * radius
  std::vector<std::uint32_t> patch;
  std::vector<float> count;                      ///< samples
  std::array<std::vector<float>, 3> irradiance;  ///< soft light of a white surface
  std::vector<float> grey;                       ///< its luminance
  std::vector<float> grey_m2;                    ///< sum of squared deviations of the samples of `grey`

  void reset(int new_radius);
};

/// Filtered texel, and the variance of its grey value.
struct FilteredTexel {
  std::array<float, 3> irradiance{};
  float variance = 0;
  bool known = false;
};

/// Radius needed for texels of `count` samples to reach `target` effective samples; 0 when they have them.
[[nodiscard]] int filter_radius(float count, float target);

/// Two one-dimensional passes (an approximation of the full kernel). Weights: Gaussian with the width at which count *
/// effective area = target; same patch only; likeness of the grey irradiance, pooled around each texel, in units of its
/// own standard error (idea of SVGF, Schied et al. 2017, section 4.4, here from sample statistics instead of history).
/// The variance treats texels as independent. Writes 32x32 texels.
class IrradianceFilter {
 public:
  void run(const FilterWindow& window, float target, std::vector<FilteredTexel>& out);

 private:
  [[nodiscard]] static int pool_radius(const FilterWindow& window);
  void pool(const FilterWindow& window);
  void prepare_weights(float target);

  struct Row {
    std::array<float, 3> irradiance{};
    float variance = 0;
    float weight = 0;
  };
  struct PoolSum {
    float samples = 0, sum = 0, squares = 0;  // of differences to a pivot
  };
  std::vector<PoolSum> pool_rows_;
  std::vector<float> pooled_;           // mean of grey around each texel
  std::vector<float> pooled_variance_;  // of that mean
  std::vector<float> texel_variance_;   // of the texel's own mean
  std::vector<Row> rows_;               // after the horizontal pass: 32 wide, size high
  std::vector<float> weights_;          // [count][distance]
  float weights_target_ = -1;
};

}  // namespace darm::renderer
