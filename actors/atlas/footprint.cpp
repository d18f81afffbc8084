#include "actors/atlas/footprint.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace darm::atlas {
namespace {

struct RowSpan {
  std::int32_t row;
  Span span;
};

/// Texels owned by one triangle (in texels, relative to the placement's first centre).
void add_triangle(const std::array<glm::vec2, 3>& t, std::vector<RowSpan>& out) {
  constexpr float reach = 1.0f + kFootprintMargin;
  const float low = std::min({t[0].y, t[1].y, t[2].y});
  const float high = std::max({t[0].y, t[1].y, t[2].y});
  const auto first = std::max(0, static_cast<std::int32_t>(std::floor(low - reach)) + 1);
  const auto last = static_cast<std::int32_t>(std::ceil(high + reach)) - 1;
  for (auto row = first; row <= last; ++row) {
    float lo = 0, hi = 0;
    const auto y = static_cast<float>(row);
    if (!extent_in_slab(t, y - reach, y + reach, lo, hi)) continue;
    const auto begin = std::max(0, static_cast<std::int32_t>(std::floor(lo - reach)) + 1);
    const auto end = static_cast<std::int32_t>(std::ceil(hi + reach));
    out.push_back({row, {begin, std::max(end, begin + 1)}});
  }
}

/// Sorts by row (counting sort), then joins spans that touch.
void join_rows(const std::vector<RowSpan>& parts, Footprint& out) {
  std::int32_t rows = 0;
  for (const auto& p : parts) rows = std::max(rows, p.row + 1);
  std::vector<std::uint32_t> first(static_cast<std::size_t>(rows) + 1, 0);
  for (const auto& p : parts) ++first[static_cast<std::size_t>(p.row) + 1];
  for (std::size_t r = 0; r < static_cast<std::size_t>(rows); ++r) first[r + 1] += first[r];
  std::vector<Span> sorted(parts.size());
  auto cursor = first;
  for (const auto& p : parts) sorted[cursor[static_cast<std::size_t>(p.row)]++] = p.span;

  std::vector<Span> row_spans;
  for (std::int32_t r = 0; r < rows; ++r) {
    const auto begin = sorted.begin() + first[static_cast<std::size_t>(r)];
    const auto end = sorted.begin() + first[static_cast<std::size_t>(r) + 1];
    std::sort(begin, end, [](const Span& a, const Span& b) { return a.begin < b.begin; });
    row_spans.clear();
    for (auto it = begin; it != end; ++it) {
      if (!row_spans.empty() && it->begin <= row_spans.back().end)
        row_spans.back().end = std::max(row_spans.back().end, it->end);
      else
        row_spans.push_back(*it);
    }
    if (row_spans.empty()) continue;
    out.height = r + 1;
    for (const auto& s : row_spans) {
      out.texels += static_cast<std::uint64_t>(s.end - s.begin);
      out.width = std::max(out.width, s.end);
    }
    if (!out.bands.empty() && out.bands.back().row + out.bands.back().rows == r &&
        std::ranges::equal(out.spans_of(out.bands.back()), row_spans)) {
      ++out.bands.back().rows;
      continue;
    }
    out.bands.push_back(
        {r, 1, static_cast<std::uint32_t>(out.spans.size()), static_cast<std::uint32_t>(row_spans.size())});
    out.spans.insert(out.spans.end(), row_spans.begin(), row_spans.end());
  }
}

}  // namespace

PatchTriangles::PatchTriangles(const Chart& chart) : first_(chart.patch_count + 1, 0) {
  for (const auto p : chart.local_patch)
    if (p != kDroppedTriangle) ++first_[p + 1];
  for (std::size_t p = 0; p < chart.patch_count; ++p) first_[p + 1] += first_[p];
  triangles_.resize(first_.back());
  auto cursor = first_;
  for (std::uint32_t t = 0; t < chart.local_patch.size(); ++t)
    if (chart.local_patch[t] != kDroppedTriangle) triangles_[cursor[chart.local_patch[t]]++] = t;
}

bool extent_in_slab(const std::array<glm::vec2, 3>& t, float bottom, float top, float& lo, float& hi) {
  lo = std::numeric_limits<float>::max();
  hi = -lo;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::vec2& p = t[i];
    const glm::vec2& q = t[(i + 1) % 3];
    const glm::vec2& a = p.y <= q.y ? p : q;
    const glm::vec2& b = p.y <= q.y ? q : p;
    if (b.y < bottom || a.y > top) continue;
    const float dy = b.y - a.y;  // > 0 wherever it divides: one end lies outside the slab, the other does not
    const float xa = a.y < bottom ? a.x + (b.x - a.x) * ((bottom - a.y) / dy) : a.x;
    const float xb = b.y > top ? a.x + (b.x - a.x) * ((top - a.y) / dy) : b.x;
    lo = std::min({lo, xa, xb});
    hi = std::max({hi, xa, xb});
  }
  return lo <= hi;
}

Footprint footprint_of(const Chart& chart, const PatchTriangles& triangles, std::uint32_t local_patch, float density) {
  Footprint out;
  const glm::vec2 size = chart.patch_size[local_patch] * density;
  if (size.x < 1 && size.y < 1) {
    out.width = out.height = 1;
    out.scale = 0;
    out.texels = 1;
    out.bands.push_back({0, 1, 0, 1});
    out.spans.push_back({0, 1});
    return out;
  }
  thread_local std::vector<RowSpan> parts;
  parts.clear();
  for (const auto t : triangles.of(local_patch)) {
    const auto& uv = chart.uv[t];
    add_triangle({uv[0] * density, uv[1] * density, uv[2] * density}, parts);
  }
  join_rows(parts, out);
  return out;
}

}  // namespace darm::atlas
