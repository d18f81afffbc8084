// Sums over the neighbourhood of every texel of a filter window that never leave its patch.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "actors/renderer/filter_window.hpp"

namespace darm::renderer {

/// Widest neighbourhood, texels to each side.
inline constexpr int kMaxSumRadius = 7;

/// Texels in a row belong together as far as their key stays the same. Sums grow by doubling, each side for itself, so
/// that nothing is ever taken away again (floats suffice, however bright one texel is) and loops vectorise. Keeps
/// scratch memory: one per thread.
class PatchSums {
 public:
  /// Keys, one a texel of a square `size` wide, row-major: one for what belongs together in rows, one in columns.
  /// `nobody` belongs with nothing, not even its like.
  void connect(const std::vector<std::uint32_t>& in_rows, const std::vector<std::uint32_t>& in_columns, int size,
               std::uint32_t nobody);

  /// Replaces each value of `plane` (size * size, finite) by the sum over the rows of its column, of what their texels
  /// reach in their rows: a square, but for patches that wind. `radius`: 1, 3 or 7.
  void sum(std::vector<float>& plane, int radius);

  /// Texels that belong to each before and after it, at most kMaxSumRadius counted: left, right, up, down.
  void reach(std::array<std::vector<float>, 4>& out) const;

 private:
  static constexpr int kSteps = 3;  // 1, 2, 4 texels
  static constexpr int kPad = 8;
  static constexpr int kStride = kSlotSize + 2 * kMaxFilterRadius + 2 * kPad;
  [[nodiscard]] const float* row_links(int step, int y) const {
    return &row_links_[static_cast<std::size_t>(step)][static_cast<std::size_t>(y * kStride + kPad)];
  }
  void sum_rows(std::vector<float>& plane, int steps) const;
  void sum_columns(std::vector<float>& plane, int steps);

  int size_ = 0;
  std::array<std::vector<float>, kSteps> row_links_;     // 1: texel and that 2^step after it belong together
  std::array<std::vector<float>, kSteps> column_links_;  // the same downwards
  std::vector<float> after_, before_;
};

}  // namespace darm::renderer
