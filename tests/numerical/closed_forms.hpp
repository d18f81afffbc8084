// Shapes whose light is known in closed form, in double.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "actors/scene/scene.hpp"

namespace darm::numerical {

/// Form factor of two facing unit squares at a distance (Howell, A Catalog of Radiation Heat Transfer Configuration
/// Factors, C-11).
[[nodiscard]] inline double facing_squares(double distance) {
  const double x = 1 / distance;
  const double w = std::sqrt(1 + x * x);
  return 2 / (M_PI * x * x) *
         (std::log(w * w / std::sqrt(1 + 2 * x * x)) + 2 * x * w * std::atan(x / w) - 2 * x * std::atan(x));
}

/// Form factor of two unit squares at a right angle with a common edge (Howell C-14 with H = W = 1).
[[nodiscard]] inline double upright_squares() {
  const double root = std::sqrt(2.0);
  return (2 * std::atan(1.0) - root * std::atan(1 / root) + 0.25 * std::log(0.75)) / M_PI;
}

/// Configuration factor of a plane element under a parallel disc `height` above, whose axis is `aside` (Howell B-12).
[[nodiscard]] inline double disc_above(double radius, double height, double aside) {
  if (aside == 0) return radius * radius / (radius * radius + height * height);
  const double h = height / aside, r = radius / aside;
  const double z = 1 + h * h + r * r;
  return 0.5 * (1 - (z - 2 * r * r) / std::sqrt(z * z - 4 * r * r));
}

/// Irradiance at `at` with normal `n` from a polygon of radiance 1 that lies wholly above the horizon: half the sum of
/// the edges' angles times their planes' cosines (Lambert 1760). Either winding.
[[nodiscard]] inline double polygon_irradiance(const std::vector<glm::dvec3>& polygon, const glm::dvec3& at,
                                               const glm::dvec3& n) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec3 a = glm::normalize(polygon[i] - at);
    const glm::dvec3 b = glm::normalize(polygon[(i + 1) % polygon.size()] - at);
    const glm::dvec3 axis = glm::cross(a, b);
    const double sine = glm::length(axis);
    if (sine > 0) sum += std::atan2(sine, glm::dot(a, b)) * glm::dot(axis / sine, n);
  }
  return std::abs(sum) / 2;
}

/// A polygon in y = centre.y with as much area as the disc, looking down.
[[nodiscard]] inline std::vector<glm::dvec3> regular_polygon(double radius, int corners, const glm::dvec3& centre) {
  const double turn = 2 * M_PI / corners;
  const double reach = radius * std::sqrt(turn / std::sin(turn));
  std::vector<glm::dvec3> out;
  for (int i = 0; i < corners; ++i)
    out.push_back(centre + reach * glm::dvec3(std::cos(turn * i), 0, std::sin(turn * i)));
  return out;
}

/// Triangles over a convex polygon; front where it runs counter-clockwise.
[[nodiscard]] inline scene::Mesh fan(const std::vector<glm::dvec3>& polygon) {
  scene::Mesh m;
  const glm::vec3 n(glm::normalize(glm::cross(polygon[1] - polygon[0], polygon[2] - polygon[0])));
  for (const auto& p : polygon) m.positions.emplace_back(p);
  m.normals.assign(polygon.size(), n);
  for (std::uint32_t i = 2; i < polygon.size(); ++i) m.triangles.emplace_back(0, i - 1, i);
  return m;
}

/// The same triangles, each with its own normal.
[[nodiscard]] inline scene::Mesh flat(const scene::Mesh& smooth) {
  scene::Mesh m;
  m.material = smooth.material;
  for (const auto& t : smooth.triangles) {
    const glm::dvec3 a(smooth.positions[t.x]), b(smooth.positions[t.y]), c(smooth.positions[t.z]);
    const auto first = static_cast<std::uint32_t>(m.positions.size());
    m.positions.insert(m.positions.end(), {glm::vec3(a), glm::vec3(b), glm::vec3(c)});
    m.normals.insert(m.normals.end(), 3, glm::vec3(glm::normalize(glm::cross(b - a, c - a))));
    m.triangles.emplace_back(first, first + 1, first + 2);
  }
  return m;
}

/// A closed ball of 2n x n quads, fronts inwards or outwards, smooth normals.
[[nodiscard]] inline scene::Mesh ball(float radius, int n, bool inwards, std::uint32_t material,
                                      const glm::vec3& centre = glm::vec3(0.0f)) {
  scene::Mesh m;
  m.material = material;
  const auto add = [&](double polar, double azimuth) {
    const glm::vec3 d(static_cast<float>(std::sin(polar) * std::cos(azimuth)), static_cast<float>(std::cos(polar)),
                      static_cast<float>(std::sin(polar) * std::sin(azimuth)));
    m.positions.push_back(centre + d * radius);
    m.normals.push_back(inwards ? -d : d);
  };
  add(0, 0);
  for (int ring = 1; ring < n; ++ring)
    for (int i = 0; i < 2 * n; ++i) add(M_PI * ring / n, M_PI * i / n);
  add(M_PI, 0);
  const auto across = static_cast<std::uint32_t>(2 * n);
  const auto last = static_cast<std::uint32_t>(m.positions.size() - 1);
  const auto face = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    inwards ? m.triangles.emplace_back(a, c, b) : m.triangles.emplace_back(a, b, c);
  };
  for (std::uint32_t i = 0; i < across; ++i) {
    const std::uint32_t next = (i + 1) % across;
    face(0, 1 + next, 1 + i);
    face(last, last - across + i, last - across + next);
    for (std::uint32_t ring = 0; ring + 2 < static_cast<std::uint32_t>(n); ++ring) {
      const std::uint32_t a = 1 + ring * across;
      face(a + i, a + next, a + across + next);
      face(a + i, a + across + next, a + across + i);
    }
  }
  return m;
}

}  // namespace darm::numerical
