// Maps from the unit square to the shapes that light is sampled on, with their densities.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <vector>

namespace darm::renderer {

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr float kInversePi = std::numbers::inv_pi_v<float>;

[[nodiscard]] inline float luminance(const glm::vec3& rgb) {
  return 0.2126f * rgb.x + 0.7152f * rgb.y + 0.0722f * rgb.z;
}

/// Uniform point of the unit disc (Shirley & Chiu's concentric map).
[[nodiscard]] inline glm::vec2 sample_disc(const glm::vec2& xi) {
  const float a = 2.0f * xi.x - 1.0f;
  const float b = 2.0f * xi.y - 1.0f;
  if (a == 0 && b == 0) return {0, 0};
  const bool wide = std::abs(a) > std::abs(b);
  const float r = wide ? a : b;
  const float phi = wide ? kPi / 4 * (b / a) : kPi / 2 - kPi / 4 * (a / b);
  return {r * std::cos(phi), r * std::sin(phi)};
}

/// Direction about +z with density cos / pi. z > 0 always.
[[nodiscard]] inline glm::vec3 sample_cosine(const glm::vec2& xi) {
  const glm::vec2 d = sample_disc(xi);
  return {d.x, d.y, std::sqrt(std::max(1e-8f, 1.0f - d.x * d.x - d.y * d.y))};
}

/// Direction about +z, uniform over the cap whose rim lies `chord2` (squared distance) from the pole; density
/// 1 / (pi chord2). Exact for caps far smaller than float can hold as a cosine.
[[nodiscard]] inline glm::vec3 sample_cap(const glm::vec2& xi, float chord2) {
  const float height = 0.5f * xi.x * chord2;
  const float radius = std::sqrt(std::max(0.0f, height * (2.0f - height)));
  const float phi = 2.0f * kPi * xi.y;
  return {radius * std::cos(phi), radius * std::sin(phi), 1.0f - height};
}

/// Uniform barycentrics (u, v) of a triangle (Heitz 2019, low distortion).
[[nodiscard]] inline glm::vec2 sample_triangle(const glm::vec2& xi) {
  if (xi.y > xi.x) {
    const float x = 0.5f * xi.x;
    return {x, xi.y - x};
  }
  const float y = 0.5f * xi.y;
  return {xi.x - y, y};
}

/// Normal visible from `wo` (z > 0), GGX of roughness `alpha` (Heitz, Sampling the GGX Distribution of Visible
/// Normals, JCGT 2018).
[[nodiscard]] inline glm::vec3 sample_visible_normal(const glm::vec3& wo, float alpha, const glm::vec2& xi) {
  const glm::vec3 v = glm::normalize(glm::vec3(alpha * wo.x, alpha * wo.y, wo.z));
  const float square = v.x * v.x + v.y * v.y;
  const glm::vec3 t1 = square > 1e-14f ? glm::vec3(-v.y, v.x, 0) * (1.0f / std::sqrt(square)) : glm::vec3(1, 0, 0);
  const glm::vec3 t2 = glm::cross(v, t1);
  const float r = std::sqrt(xi.x);
  const float phi = 2.0f * kPi * xi.y;
  const float p1 = r * std::cos(phi);
  const float s = 0.5f * (1.0f + v.z);
  const float p2 = (1.0f - s) * std::sqrt(std::max(0.0f, 1.0f - p1 * p1)) + s * r * std::sin(phi);
  const glm::vec3 n = t1 * p1 + t2 * p2 + v * std::sqrt(std::max(0.0f, 1.0f - p1 * p1 - p2 * p2));
  return glm::normalize(glm::vec3(alpha * n.x, alpha * n.y, std::max(1e-7f, n.z)));
}

/// Weight of the strategy with density `own` against another with density `other` (power heuristic, Veach 1995).
[[nodiscard]] inline float mis_weight(float own, float other) {
  if (!(own > 0)) return 0;
  const float ratio = other / own;
  return 1.0f / (1.0f + ratio * ratio);
}

/// Walker's alias table: draws index i with probability weight_i / sum in constant time.
class AliasTable {
 public:
  AliasTable() = default;
  /// Weights must be finite and >= 0. All zero or none: the table is empty.
  explicit AliasTable(const std::vector<double>& weights);
  [[nodiscard]] bool empty() const { return entries_.empty(); }
  [[nodiscard]] float probability(std::size_t i) const { return entries_[i].probability; }
  /// `xi` in [0, 1) is used up and replaced by a fresh number in [0, 1).
  [[nodiscard]] std::uint32_t draw(float& xi) const {
    const float scaled = xi * static_cast<float>(entries_.size());
    auto i = std::min(static_cast<std::uint32_t>(scaled), static_cast<std::uint32_t>(entries_.size() - 1));
    const float rest = std::min(scaled - static_cast<float>(i), 0.99999994f);
    const Entry& entry = entries_[i];
    if (rest < entry.keep) {
      xi = std::min(rest / entry.keep, 0.99999994f);
      return i;
    }
    xi = std::min((rest - entry.keep) / (1.0f - entry.keep), 0.99999994f);
    return entry.alias;
  }

 private:
  struct Entry {
    float keep = 1;
    std::uint32_t alias = 0;
    float probability = 0;
  };
  std::vector<Entry> entries_;
};

}  // namespace darm::renderer
