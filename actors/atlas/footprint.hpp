// The texels a patch owns at a density: the shape the packer works with.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "actors/atlas/layout.hpp"

namespace darm::atlas {

/// Texels begin..end-1 of a row.
struct Span {
  std::int32_t begin = 0;
  std::int32_t end = 0;
  bool operator==(const Span&) const = default;
};

/// Own texels of a patch, relative to Placement (x, y): every texel whose centre is less than one texel (Chebyshev)
/// from the surface, which is every texel a bilinear tap of the surface reads. Rows are spans, ascending, apart.
/// `bands` are runs of rows with equal spans.
struct Footprint {
  struct Band {
    std::int32_t row = 0;  ///< first row
    std::int32_t rows = 0;
    std::uint32_t first_span = 0;  ///< index into `spans`
    std::uint32_t span_count = 0;
  };
  std::int32_t width = 0;
  std::int32_t height = 0;
  float scale = 1;  ///< Placement::scale
  std::uint64_t texels = 0;
  std::vector<Band> bands;  ///< rows that own nothing are in none
  std::vector<Span> spans;

  [[nodiscard]] std::span<const Span> spans_of(const Band& b) const {
    return {spans.data() + b.first_span, b.span_count};
  }
};

/// Margin on the distance of one texel, so that rounding on a client's GPU never leaves the patch's own texels.
inline constexpr float kFootprintMargin = 1.0f / 512.0f;

/// Triangles of each local patch of a chart, as a compressed row list.
class PatchTriangles {
 public:
  explicit PatchTriangles(const Chart& chart);
  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t local_patch) const {
    return {triangles_.data() + first_[local_patch], first_[local_patch + 1] - first_[local_patch]};
  }

 private:
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> triangles_;
};

/// Footprint of a local patch at `density` texels per world unit. A patch with both extents under one texel is one
/// texel with scale 0.
[[nodiscard]] Footprint footprint_of(const Chart& chart, const PatchTriangles& triangles, std::uint32_t local_patch,
                                     float density);

/// Extent [lo, hi] in x of the part of a triangle with bottom <= y <= top; false if there is none.
[[nodiscard]] bool extent_in_slab(const std::array<glm::vec2, 3>& t, float bottom, float top, float& lo, float& hi);

}  // namespace darm::atlas
