// Removes noise from soft light while it converges: a cross-bilateral filter over irradiance, so that textures (albedo)
// stay sharp, which narrows as the texel's own error falls and vanishes at the end, so that the limit is unbiased.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "actors/renderer/filter_statistics.hpp"
#include "actors/renderer/filter_window.hpp"
#include "actors/renderer/line_fits.hpp"

namespace darm::renderer {

/// Filtered texel.
struct FilteredTexel {
  std::array<float, 3> irradiance{};
  /// What outliers lost here and is not to be shown: right in the mean over many texels, not in this one.
  std::array<float, 3> withheld{};
  float lost_error = 0;  ///< what is shown of what they lost is off by: luminance, RMS
  float variance = 0;    ///< of its grey value: noise
  float texels = 1;      ///< so many gave to it, by what they took of the noise; >= 1
  /// Square of what the filter has smeared of its grey value: the square difference to the mean it was compared by
  /// (of fewer texels, at borders only of those along it), less what noise alone makes of that. Below 0 by chance: only
  /// sums over many texels say something.
  float smear = 0;
  bool known = false;
};

/// Two one-dimensional passes (an approximation of the full kernel). Weights: Gaussian over the texels that bring the
/// error to what WindowStatistics says; same patch; likeness of the grey
/// irradiance, pooled around each texel, in units of its own standard error (idea of SVGF, Schied et al. 2017, section
/// 4.4, here from sample statistics instead of history). The variance treats texels as independent. Writes 32x32
/// texels. A function of window and `target` alone. Keeps scratch memory: one per thread.
class IrradianceFilter {
 public:
  IrradianceFilter();
  void run(const FilterWindow& window, float target, std::vector<FilteredTexel>& out);

 private:
  static constexpr int kBlocks = kSlotSize / kLanes;  // in a row
  void prepare(const FilterWindow& window);
  void find_lit(const FilterWindow& window);
  void filter_rows(const FilterWindow& window);
  void filter_columns(const FilterWindow& window, std::vector<FilteredTexel>& out);
  [[nodiscard]] float smear_of(std::size_t at, const FilteredTexel& texel, float weight) const;
  [[nodiscard]] int reach_of(std::size_t first) const;
  [[nodiscard]] FitCentres centres_at(const std::vector<std::uint32_t>& stretches, std::size_t first) const;
  [[nodiscard]] Fitted& block(int y, int number) { return rows_[static_cast<std::size_t>(y * kBlocks + number)]; }

  WindowStatistics statistics_;
  bool with_slope_ = true;
  std::vector<float> variance_;                       // of each texel's mean
  std::vector<float> first_;                          // the Gaussian's value one texel away
  std::vector<std::uint8_t> lit_;                     // some of the kLanes texels from here on has samples
  std::vector<Fitted> rows_;                          // after the horizontal pass: [row][block]
  std::vector<std::uint8_t> filled_;                  // some of that block is known
  std::array<float, kAreaClasses> firsts_{};          // of each class: that value
  std::array<std::uint8_t, kAreaClasses> reaches_{};  // and the last texel it reaches
};

}  // namespace darm::renderer
