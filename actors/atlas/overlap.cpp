#include "actors/atlas/overlap.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

namespace darm::atlas {
namespace {

/// How many triangles one candidate is compared with before it is refused.
constexpr int kCompareLimit = 4096;

/// True if an edge of `a` (counter-clockwise) has all of `b` on its outer side, up to `slack` (a length).
bool edge_separates(const FlatTriangle& a, const FlatTriangle& b, double slack) {
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec2 e = a[(i + 1) % 3] - a[i];
    const double tolerance = slack * (std::abs(e.x) + std::abs(e.y));
    if (cross(e, b[0] - a[i]) <= tolerance && cross(e, b[1] - a[i]) <= tolerance && cross(e, b[2] - a[i]) <= tolerance)
      return true;
  }
  return false;
}

bool overlaps(const FlatTriangle& a, const FlatTriangle& b, double slack) {
  return !edge_separates(a, b, slack) && !edge_separates(b, a, slack);
}

/// Uniform grid over the patch; each cell lists the triangles of the current piece that touch it.
class CellGrid {
 public:
  CellGrid(const std::vector<FlatTriangle>& triangles) {
    glm::dvec2 hi(-std::numeric_limits<double>::max());
    low_ = -hi;
    for (const auto& t : triangles)
      for (const auto& p : t) {
        low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y)};
        hi = {std::max(hi.x, p.x), std::max(hi.y, p.y)};
      }
    const glm::dvec2 size = hi - low_;
    extent_ = std::max({size.x, size.y, 1e-30});
    const double cell = std::max(std::sqrt(std::max(size.x * size.y, 1e-60) / static_cast<double>(triangles.size())),
                                 extent_ / (2.0 * static_cast<double>(triangles.size()) + 8));
    nx_ = 1 + static_cast<int>(size.x / cell);
    ny_ = 1 + static_cast<int>(size.y / cell);
    cell_ = cell;
    cells_.resize(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_));
  }

  double extent() const { return extent_; }

  /// visit(cell) for each cell the triangle touches, until it returns false.
  template <class Visit>
  void for_each_cell(const FlatTriangle& t, const Visit& visit) {
    const int y0 = row(std::min({t[0].y, t[1].y, t[2].y}));
    const int y1 = row(std::max({t[0].y, t[1].y, t[2].y}));
    for (int y = y0; y <= y1; ++y) {
      double lo = std::numeric_limits<double>::max();
      double hi = -lo;
      const double bottom = low_.y + y * cell_;
      const double top = bottom + cell_;
      for (std::size_t i = 0; i < 3; ++i) span_in_slab(t[i], t[(i + 1) % 3], bottom, top, lo, hi);
      if (lo > hi) continue;
      for (int x = column(lo), x1 = column(hi); x <= x1; ++x)
        if (!visit(cells_[static_cast<std::size_t>(y) * static_cast<std::size_t>(nx_) + static_cast<std::size_t>(x)]))
          return;
    }
  }

 private:
  int row(double y) const { return std::clamp(static_cast<int>((y - low_.y) / cell_), 0, ny_ - 1); }
  int column(double x) const { return std::clamp(static_cast<int>((x - low_.x) / cell_), 0, nx_ - 1); }

  static void span_in_slab(glm::dvec2 a, glm::dvec2 b, double bottom, double top, double& lo, double& hi) {
    if (a.y > b.y) std::swap(a, b);
    if (b.y < bottom || a.y > top) return;
    const double dy = b.y - a.y;
    const auto x_at = [&](double y) { return a.x + (b.x - a.x) * (y - a.y) / dy; };
    const double xa = a.y < bottom && dy > 0 ? x_at(bottom) : a.x;
    const double xb = b.y > top && dy > 0 ? x_at(top) : b.x;
    lo = std::min({lo, xa, xb});
    hi = std::max({hi, xa, xb});
  }

  glm::dvec2 low_;
  double extent_ = 1, cell_ = 1;
  int nx_ = 1, ny_ = 1;
  std::vector<std::vector<std::uint32_t>> cells_;
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> edge_neighbours(const std::vector<std::array<std::uint32_t, 3>>& corners) {
  struct Use {
    std::uint64_t key;
    std::uint32_t slot;
  };
  std::vector<Use> uses;
  uses.reserve(corners.size() * 3);
  for (std::uint32_t t = 0; t < corners.size(); ++t)
    for (std::uint32_t c = 0; c < 3; ++c) {
      const std::uint64_t a = corners[t][c];
      const std::uint64_t b = corners[t][(c + 1) % 3];
      uses.push_back({std::min(a, b) << 32 | std::max(a, b), t * 3 + c});
    }
  std::sort(uses.begin(), uses.end(),
            [](const Use& a, const Use& b) { return a.key != b.key ? a.key < b.key : a.slot < b.slot; });
  std::vector<std::array<std::uint32_t, 3>> out(corners.size(), {kNoNeighbour, kNoNeighbour, kNoNeighbour});
  for (std::size_t i = 0; i + 1 < uses.size(); ++i) {
    if (uses[i].key != uses[i + 1].key) continue;
    if (i + 2 < uses.size() && uses[i + 2].key == uses[i].key) {  // more than two: nobody is a neighbour over it
      const auto key = uses[i].key;
      while (i + 1 < uses.size() && uses[i + 1].key == key) ++i;
      continue;
    }
    out[uses[i].slot / 3][uses[i].slot % 3] = uses[i + 1].slot / 3;
    out[uses[i + 1].slot / 3][uses[i + 1].slot % 3] = uses[i].slot / 3;
    ++i;
  }
  return out;
}

std::vector<std::uint32_t> pieces_without_overlap(const std::vector<FlatTriangle>& triangles,
                                                  const std::vector<std::array<std::uint32_t, 3>>& neighbours) {
  constexpr std::uint32_t kNone = 0xffffffffu;
  const auto n = static_cast<std::uint32_t>(triangles.size());
  std::vector<std::uint32_t> piece(n, kNone);
  std::vector<std::uint32_t> seen_in(n, 0);  // last question in which this one was compared
  std::uint32_t question = 0;
  CellGrid grid(triangles);
  const double slack = 1e-6 * grid.extent();

  std::uint32_t pieces = 0;
  std::deque<std::uint32_t> open;
  const auto take = [&](std::uint32_t t) {
    piece[t] = pieces;
    open.push_back(t);
    grid.for_each_cell(triangles[t], [&](std::vector<std::uint32_t>& cell) {
      cell.push_back(t);
      return true;
    });
  };
  const auto fits = [&](std::uint32_t t) {
    bool fit = true;
    int compared = 0;
    ++question;
    grid.for_each_cell(triangles[t], [&](std::vector<std::uint32_t>& cell) {
      std::erase_if(cell, [&](std::uint32_t other) { return piece[other] != pieces; });  // left from an earlier piece
      for (const auto other : cell) {
        if (seen_in[other] == question) continue;
        seen_in[other] = question;
        if (++compared > kCompareLimit || overlaps(triangles[t], triangles[other], slack)) return fit = false;
      }
      return true;
    });
    return fit;
  };
  for (std::uint32_t seed = 0; seed < n; ++seed) {
    if (piece[seed] != kNone) continue;
    take(seed);
    while (!open.empty()) {
      const auto t = open.front();
      open.pop_front();
      for (const auto next : neighbours[t]) {
        if (next == kNoNeighbour || piece[next] != kNone) continue;
        if (fits(next)) take(next);
      }
    }
    ++pieces;
  }
  return piece;
}

}  // namespace darm::atlas
