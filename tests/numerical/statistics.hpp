// Estimates with their own error, and chi-square: what the statistical tests judge by.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "actors/renderer/sampler.hpp"

namespace darm::numerical {

/// Standard errors a mean may be off: a correct estimator fails once in 1.7 million.
inline constexpr double kSigmas = 5;
/// Normal deviate a chi-square may reach: once in a million (one-sided).
inline constexpr double kChiDeviate = 4.753;

struct Estimate {
  double mean = 0;
  double error = 0;  // standard error of the mean
  /// Distance from the truth in standard errors; `slack` (absolute) is what float and the truth's own quadrature cost.
  [[nodiscard]] double sigmas_from(double truth, double slack) const {
    const double off = std::max(0.0, std::abs(mean - truth) - slack);
    return off == 0 ? 0 : off / error;
  }
};

/// Mean of `samples` draws in runs of 64 that share a pixel. Runs are independent, samples of one run are stratified:
/// the spread of the runs' means is the honest error.
template <class Draw>
[[nodiscard]] Estimate estimate(std::uint32_t samples, std::uint64_t seed, const Draw& draw) {
  constexpr std::uint32_t kRun = 64;
  const std::uint32_t runs = std::max(8u, samples / kRun);
  double mean = 0, m2 = 0;
  for (std::uint32_t run = 0; run < runs; ++run) {
    double sum = 0;
    for (std::uint32_t i = 0; i < kRun; ++i) {
      renderer::Sampler sampler(seed, renderer::hash_pair(run, 77), i);
      sum += static_cast<double>(draw(sampler));
    }
    const double delta = sum / kRun - mean;
    mean += delta / (run + 1);
    m2 += delta * (sum / kRun - mean);
  }
  return {mean, std::sqrt(m2 / (runs - 1) / runs)};
}

/// A point of the unit square, independent for each number.
[[nodiscard]] inline glm::vec2 independent_point(std::uint64_t seed, std::uint32_t number) {
  renderer::Sampler s(seed, number, 0);
  return s.next_2d();
}

/// Normal deviate of a chi-square of counts against expected counts (Wilson & Hilferty); cells that expect under 5 are
/// pooled.
[[nodiscard]] inline double chi_deviate(const std::vector<double>& counts, const std::vector<double>& expected) {
  double chi2 = 0, pooled_count = 0, pooled_expected = 0;
  int freedom = -1;
  const auto take = [&](double count, double wanted) {
    chi2 += (count - wanted) * (count - wanted) / wanted;
    ++freedom;
  };
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (expected[i] >= 5) {
      take(counts[i], expected[i]);
    } else {
      pooled_count += counts[i];
      pooled_expected += expected[i];
    }
  }
  if (pooled_expected >= 5) take(pooled_count, pooled_expected);
  if (pooled_expected < 1e-9 && pooled_count > 0) return 1e9;  // what cannot happen has happened
  if (freedom < 1) return 0;
  const double a = 2.0 / (9.0 * freedom);
  return (std::cbrt(chi2 / freedom) - (1 - a)) / std::sqrt(a);
}

}  // namespace darm::numerical
