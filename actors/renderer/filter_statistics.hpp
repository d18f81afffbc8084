// What the samples in a filter window say of themselves: means, spread, and how far each texel is from good enough.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "actors/renderer/filter_window.hpp"
#include "actors/renderer/patch_sums.hpp"

namespace darm::renderer {

/// Classes of the area a texel is averaged over, eight an octave: class 0 is the texel alone.
inline constexpr int kAreaClasses = 69;
inline constexpr float kMostArea = 384;  ///< texels; more than the widest filter holds
[[nodiscard]] float area_of_class(int area_class);

/// Keeps scratch memory: one per thread.
class WindowStatistics {
 public:
  WindowStatistics();
  /// `target` > 0: samples that a texel of usual noise (kUsualNoise) gathers; a noisier one gathers more, by the
  /// square. A first pass (FilterWindow::first_pass) says too little of its noise for that, and is taken as usual.
  void run(const FilterWindow& window, float target);

  /// Texels of a row (column) that have the same name are of one patch, and nothing stands between them.
  [[nodiscard]] const std::vector<std::uint32_t>& row_stretches() const { return row_stretches_; }
  [[nodiscard]] const std::vector<std::uint32_t>& column_stretches() const { return column_stretches_; }
  /// Mean of grey over all samples of the same patch around each texel, and the variance of that mean: what texels are
  /// compared by. No samples: variance 1e30, like everything.
  [[nodiscard]] const std::vector<float>& mean() const { return mean_; }
  [[nodiscard]] const std::vector<float>& variance() const { return variance_; }
  /// Variance of one sample of grey.
  [[nodiscard]] const std::vector<float>& spread() const { return spread_; }
  /// The same from differences inside of texels alone: for what must not be too large on average, and may be far off
  /// for one texel. Of a first pass it is spread().
  [[nodiscard]] const std::vector<float>& inside() const { return inside_; }
  [[nodiscard]] const std::vector<std::uint8_t>& area_class() const { return area_class_; }
  /// What texels differ from those beside them by, over what their samples' spread says they would: under 1, because
  /// samples of one texel are laid out evenly. 1 at most, and of a first pass.
  [[nodiscard]] float evenness() const { return evenness_; }
  /// The highest of them.
  [[nodiscard]] int widest_class() const { return widest_class_; }

 private:
  /// In units of unit_, so that squares stay in the range of float whatever light is.
  struct Sums {
    std::vector<float> samples, sum, squares;  // of differences to a pivot
    std::vector<float> within, freedom;        // inside of texels alone
  };
  bool name_stretches(const FilterWindow& window);  // false: no walls, and they are the patches
  void measure(const FilterWindow& window);
  void sum_around(PatchSums& patches, int radius, bool within);
  [[nodiscard]] float spread_of(std::size_t at, bool first_pass) const;
  void ring(const FilterWindow& window);
  void compare_neighbours(const FilterWindow& window);
  void compare_by(const FilterWindow& window, bool first_pass);
  void widen(const FilterWindow& window, PatchSums& stretches, float target);
  [[nodiscard]] float held(int area_class, std::size_t at) const;

  float pivot_ = 0;
  float unit_ = 1;
  float evenness_ = 1;
  float texel_samples_ = 0;  // mean over the patches' texels
  int widest_class_ = 0;
  PatchSums by_patch_, by_stretch_, by_ring_;
  Sums own_, around_;
  std::vector<std::uint32_t> row_stretches_, column_stretches_;
  std::vector<std::uint32_t> row_rings_, column_rings_;
  std::vector<std::uint8_t> depth_, least_;
  std::array<std::vector<float>, 4> reach_;
  std::vector<float> mean_, variance_, spread_, inside_, wide_, wide_count_, noise_, tinted_;
  std::vector<std::uint8_t> area_class_;
  std::vector<float> side_shares_;  // [area class][texels to one side]: of a Gaussian along a line
};

}  // namespace darm::renderer
