#include "actors/atlas/flatten.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "actors/atlas/lscm.hpp"

namespace darm::atlas {
namespace {

/// Cosine above which a projection keeps every triangle's area within half a percent.
constexpr double kPlanarCosine = 0.997;
/// Cosine above which the mean normal is a better axis to project along than the bin's.
constexpr double kProjectableCosine = 0.4;
/// Conformal maps may shrink or grow a triangle's area by this factor, against the whole patch.
constexpr double kMaxAreaStretch = 2.5;

double flat_area(const FlatTriangle& t) { return 0.5 * cross(t[1] - t[0], t[2] - t[0]); }

struct Surface {
  std::vector<double> areas;
  std::vector<glm::dvec3> normals;
  double area = 0;
  glm::dvec3 mean_normal{0, 0, 1};
  double least_cosine = 1;  ///< of any triangle's normal against the mean
};

Surface measure(const RawPatch& patch) {
  Surface s;
  glm::dvec3 sum(0.0);
  for (const auto& c : patch.corners) {
    const auto& a = patch.positions[c[0]];
    const glm::dvec3 n = glm::cross(patch.positions[c[1]] - a, patch.positions[c[2]] - a);
    const double length = glm::length(n);
    s.areas.push_back(0.5 * length);
    s.normals.push_back(n / length);  // length > 0: find_patches left the others out
    s.area += 0.5 * length;
    sum += n;
  }
  const double length = glm::length(sum);
  s.mean_normal = length > 0 ? sum / length : s.normals.front();
  for (const auto& n : s.normals) s.least_cosine = std::min(s.least_cosine, glm::dot(n, s.mean_normal));
  return s;
}

std::vector<FlatTriangle> project(const RawPatch& patch, const glm::dvec3& axis) {
  const glm::dvec3 side = std::abs(axis.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 x = glm::normalize(glm::cross(side, axis));
  const glm::dvec3 y = glm::cross(axis, x);
  std::vector<FlatTriangle> out;
  out.reserve(patch.corners.size());
  for (const auto& c : patch.corners) {
    auto& t = out.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) t[i] = {glm::dot(patch.positions[c[i]], x), glm::dot(patch.positions[c[i]], y)};
  }
  return out;
}

/// The conformal map if it is there and fit for use: no flips, no triangle far off its area.
std::optional<std::vector<FlatTriangle>> conformal(const RawPatch& patch, const Surface& surface) {
  if (patch.corners.size() > kMaxConformalTriangles) return std::nullopt;
  const auto flat = least_squares_conformal_map(patch.positions, patch.corners);
  if (!flat) return std::nullopt;
  std::vector<FlatTriangle> out;
  out.reserve(patch.corners.size());
  double total = 0;
  for (const auto& c : patch.corners) {
    out.push_back({(*flat)[c[0]], (*flat)[c[1]], (*flat)[c[2]]});
    const double area = flat_area(out.back());
    if (!(area > 0)) return std::nullopt;
    total += area;
  }
  const double mean = total / surface.area;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double stretch = flat_area(out[i]) / (surface.areas[i] * mean);
    if (!(stretch < kMaxAreaStretch && stretch > 1 / kMaxAreaStretch)) return std::nullopt;
  }
  return out;
}

/// Corners of the convex hull, counter-clockwise (Andrew's monotone chain).
std::vector<glm::dvec2> convex_hull(std::vector<glm::dvec2> points) {
  std::sort(points.begin(), points.end(),
            [](const glm::dvec2& a, const glm::dvec2& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  std::vector<glm::dvec2> hull(points.size() * 2);
  std::size_t k = 0;
  const auto add = [&](const glm::dvec2& p, std::size_t floor) {
    while (k >= floor + 2 && cross(hull[k - 1] - hull[k - 2], p - hull[k - 1]) <= 0) --k;
    hull[k++] = p;
  };
  for (const auto& p : points) add(p, 0);
  const std::size_t upper = k - 1;
  for (auto it = points.rbegin() + 1; it != points.rend(); ++it) add(*it, upper);
  hull.resize(k - 1);
  return hull;
}

/// Unit direction of the long side of the smallest rectangle around the hull: one side of it lies on a hull edge.
glm::dvec2 long_direction(const std::vector<glm::dvec2>& hull) {
  double best_area = std::numeric_limits<double>::max();
  glm::dvec2 best(0, 1);
  // A hull of many corners is round: every stride-th edge is close enough to the best, and the time stays bounded.
  const std::size_t stride = 1 + hull.size() / 256;
  for (std::size_t i = 0; i < hull.size(); i += stride) {
    const glm::dvec2 e = hull[(i + 1) % hull.size()] - hull[i];
    const double length = glm::length(e);
    if (!(length > 0)) continue;
    const glm::dvec2 u = e / length;
    glm::dvec2 lo(std::numeric_limits<double>::max());
    glm::dvec2 hi = -lo;
    for (const auto& p : hull) {
      const glm::dvec2 q(glm::dot(p, u), cross(u, p));
      lo = {std::min(lo.x, q.x), std::min(lo.y, q.y)};
      hi = {std::max(hi.x, q.x), std::max(hi.y, q.y)};
    }
    const glm::dvec2 size = hi - lo;
    if (size.x * size.y < best_area * (1 - 1e-9)) {
      best_area = size.x * size.y;
      best = size.x >= size.y ? u : glm::dvec2(-u.y, u.x);
    }
  }
  return best;
}

/// Turns and scales the triangles so that FlatPatch's promises hold.
void settle(FlatPatch& patch, double area) {
  std::vector<glm::dvec2> points;
  points.reserve(patch.uv.size() * 3);
  double flat = 0;
  for (const auto& t : patch.uv) {
    points.insert(points.end(), t.begin(), t.end());
    flat += flat_area(t);
  }
  const glm::dvec2 up = long_direction(convex_hull(std::move(points)));
  const glm::dvec2 right(up.y, -up.x);
  const double scale = flat > 0 ? std::sqrt(area / flat) : 1.0;
  glm::dvec2 lo(std::numeric_limits<double>::max());
  glm::dvec2 hi = -lo;
  for (auto& t : patch.uv)
    for (auto& p : t) {
      p = glm::dvec2(glm::dot(p, right), glm::dot(p, up)) * scale;
      lo = {std::min(lo.x, p.x), std::min(lo.y, p.y)};
      hi = {std::max(hi.x, p.x), std::max(hi.y, p.y)};
    }
  for (auto& t : patch.uv)
    for (auto& p : t) p -= lo;
  patch.size = hi - lo;
  patch.area = area;
}

std::vector<FlatPatch> cut(const RawPatch& patch, const Surface& surface, const std::vector<FlatTriangle>& flat,
                           const std::vector<std::uint32_t>& piece) {
  std::vector<FlatPatch> out(*std::max_element(piece.begin(), piece.end()) + 1);
  std::vector<double> areas(out.size());
  for (std::size_t i = 0; i < flat.size(); ++i) {
    out[piece[i]].triangles.push_back(patch.triangles[i]);
    out[piece[i]].uv.push_back(flat[i]);
    areas[piece[i]] += surface.areas[i];
  }
  for (std::size_t i = 0; i < out.size(); ++i) settle(out[i], areas[i]);
  return out;
}

bool is_whole(const std::vector<std::uint32_t>& piece) {
  return std::all_of(piece.begin(), piece.end(), [](std::uint32_t p) { return p == 0; });
}

}  // namespace

std::vector<FlatPatch> flatten(const RawPatch& patch) {
  const Surface surface = measure(patch);
  const auto neighbours = edge_neighbours(patch.corners);
  if (surface.least_cosine < kPlanarCosine) {
    if (const auto flat = conformal(patch, surface)) {
      const auto piece = pieces_without_overlap(*flat, neighbours);
      if (is_whole(piece)) return cut(patch, surface, *flat, piece);
    }
  }
  const bool along_mean = surface.least_cosine > kProjectableCosine;
  const glm::dvec3 axis =
      along_mean ? surface.mean_normal : glm::dvec3(patch.bin_axis[0], patch.bin_axis[1], patch.bin_axis[2]);
  const auto flat = project(patch, axis);
  return cut(patch, surface, flat, pieces_without_overlap(flat, neighbours));
}

}  // namespace darm::atlas
