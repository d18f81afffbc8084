#include "actors/atlas/lscm.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <complex>
#include <glm/geometric.hpp>

namespace darm::atlas {
namespace {

using Complex = std::complex<double>;

/// Two vertices that are far apart: the farthest from vertex 0, and the farthest from that one.
std::pair<std::uint32_t, std::uint32_t> far_pair(const std::vector<glm::dvec3>& p) {
  const auto farthest_from = [&](std::uint32_t from) {
    std::uint32_t best = from;
    double distance = -1;
    for (std::uint32_t i = 0; i < p.size(); ++i) {
      const glm::dvec3 d = p[i] - p[from];
      if (const double l = glm::dot(d, d); l > distance) distance = l, best = i;
    }
    return best;
  };
  const auto a = farthest_from(0);
  return {a, farthest_from(a)};
}

/// Weights of the three corners: the map is conformal on the triangle when sum(w_j z_j) = 0. Divided by sqrt(2 area).
std::array<Complex, 3> corner_weights(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 e1 = b - a;
  const glm::dvec3 e2 = c - a;
  const double length = glm::length(e1);
  const glm::dvec3 x = e1 / length;
  const double area2 = glm::length(glm::cross(e1, e2));
  const Complex z1(length, 0);
  const Complex z2(glm::dot(e2, x), area2 / length);
  const double norm = 1.0 / std::sqrt(area2);
  return {(z2 - z1) * norm, -z2 * norm, z1 * norm};
}

}  // namespace

std::optional<std::vector<glm::dvec2>> least_squares_conformal_map(
    const std::vector<glm::dvec3>& positions, const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  const auto n = static_cast<std::uint32_t>(positions.size());
  if (n < 3) return std::nullopt;
  const auto [pin_a, pin_b] = far_pair(positions);
  const double apart = glm::length(positions[pin_b] - positions[pin_a]);
  if (pin_a == pin_b || !(apart > 0) || !std::isfinite(apart)) return std::nullopt;

  // One complex unknown per free vertex; the normal matrix is Hermitian, assembled triangle by triangle.
  std::vector<int> column(n);
  int free_count = 0;
  for (std::uint32_t v = 0; v < n; ++v) column[v] = v == pin_a || v == pin_b ? -1 : free_count++;
  std::vector<Eigen::Triplet<Complex>> entries;
  entries.reserve(triangles.size() * 6);
  Eigen::VectorXcd rhs = Eigen::VectorXcd::Zero(free_count);
  for (const auto& t : triangles) {
    const auto w = corner_weights(positions[t[0]], positions[t[1]], positions[t[2]]);
    for (std::size_t j = 0; j < 3; ++j) {
      const int row = column[t[j]];
      if (row < 0) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const Complex h = std::conj(w[j]) * w[k];
        const int col = column[t[k]];
        if (col >= 0 && col <= row) entries.emplace_back(row, col, h);
        if (t[k] == pin_b) rhs[row] -= h * apart;  // pin_a lies at 0
      }
    }
  }
  Eigen::SparseMatrix<Complex> normal(free_count, free_count);
  normal.setFromTriplets(entries.begin(), entries.end());
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<Complex>, Eigen::Lower> solver(normal);
  if (solver.info() != Eigen::Success) return std::nullopt;
  const Eigen::VectorXcd z = solver.solve(rhs);
  if (solver.info() != Eigen::Success || !z.allFinite()) return std::nullopt;

  std::vector<glm::dvec2> flat(n);
  for (std::uint32_t v = 0; v < n; ++v)
    flat[v] = column[v] >= 0 ? glm::dvec2(z[column[v]].real(), z[column[v]].imag())
                             : glm::dvec2(v == pin_b ? apart : 0.0, 0.0);
  return flat;
}

}  // namespace darm::atlas
