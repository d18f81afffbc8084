#include "actors/atlas/tile_texels.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace darm::atlas {
namespace {

struct Foot {
  float u = 0;
  float v = 0;
  float distance2 = std::numeric_limits<float>::max();
};

/// Barycentrics of the point of a triangle nearest to `p`; distance 0 inside.
Foot nearest(const std::array<glm::vec2, 3>& t, glm::vec2 p) {
  const glm::vec2 e1 = t[1] - t[0];
  const glm::vec2 e2 = t[2] - t[0];
  const glm::vec2 d = p - t[0];
  const float det = e1.x * e2.y - e1.y * e2.x;
  if (det > 0) {
    const float u = (d.x * e2.y - d.y * e2.x) / det;
    const float v = (e1.x * d.y - e1.y * d.x) / det;
    if (u >= 0 && v >= 0 && u + v <= 1) return {u, v, 0};
  }
  Foot best;
  constexpr float corner_u[] = {0, 1, 0};
  constexpr float corner_v[] = {0, 0, 1};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const glm::vec2 e = t[j] - t[i];
    const float length2 = glm::dot(e, e);
    const float s = length2 > 0 ? std::clamp(glm::dot(p - t[i], e) / length2, 0.0f, 1.0f) : 0.0f;
    const glm::vec2 off = p - (t[i] + e * s);
    const float distance2 = glm::dot(off, off);
    if (distance2 < best.distance2)
      best = {corner_u[i] + (corner_u[j] - corner_u[i]) * s, corner_v[i] + (corner_v[j] - corner_v[i]) * s, distance2};
  }
  return best;
}

SurfacePoint point_of(const TexelFragment& f, float u, float v) {
  // Rounding may leave the triangle by a hair; u + v <= 1 is promised.
  u = std::clamp(u, 0.0f, 1.0f);
  v = std::clamp(v, 0.0f, 1.0f - u);
  return {f.instance, f.triangle, u, v, f.front};
}

}  // namespace

SurfacePoint TileTexels::sample_whole(std::span<const std::uint32_t> from, glm::vec2 xi) const {
  // Candidates of such a texel lie one after another, with their running share of the area.
  const auto it =
      std::upper_bound(from.begin(), from.end(), xi.x, [&](float x, std::uint32_t c) { return x < corners_[c][0].x; });
  const auto chosen = it == from.end() ? from.back() : *it;
  const float begin = chosen == from.front() ? 0.0f : corners_[chosen - 1][0].x;
  const float share = corners_[chosen][0].x - begin;
  const float x = share > 0 ? std::clamp((xi.x - begin) / share, 0.0f, 1.0f) : 0.5f;
  const float root = std::sqrt(x);
  return point_of(fragments_[chosen], root * (1 - xi.y), root * xi.y);
}

std::optional<SurfacePoint> TileTexels::sample(int x, int y, glm::vec2 xi) const {
  const auto from = candidates(x, y);
  if (from.empty()) return std::nullopt;
  if (flags_[texel(x, y)] & kWholePatch) return sample_whole(from, xi);
  const glm::vec2 p = glm::vec2(static_cast<float>(x), static_cast<float>(y)) + xi;
  Foot best;
  std::uint32_t chosen = from.front();
  for (const auto c : from) {
    const Foot foot = nearest(corners_[c], p);
    if (foot.distance2 < best.distance2) best = foot, chosen = c;
    if (best.distance2 <= 0) break;
  }
  return point_of(fragments_[chosen], best.u, best.v);
}

std::optional<SurfacePoint> TileTexels::center(int x, int y) const { return sample(x, y, {0.5f, 0.5f}); }

std::size_t TileTexels::bytes() const {
  return sizeof(*this) + patches_.capacity() * sizeof(PatchId) + flags_.capacity() +
         (first_.capacity() + candidates_.capacity()) * sizeof(std::uint32_t) +
         fragments_.capacity() * sizeof(TexelFragment) + corners_.capacity() * sizeof(corners_[0]);
}

}  // namespace darm::atlas
