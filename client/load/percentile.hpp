// Percentiles of measured values. Pure.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace darm::client::load {

/// The smallest value that at least `share` (0..1) of all do not exceed (nearest rank); 0 without values. Reorders
/// `values`.
template <class T>
[[nodiscard]] T percentile(std::vector<T>& values, double share) {
  if (values.empty()) return T{};
  const double rank = std::ceil(share * static_cast<double>(values.size()));
  const auto at = static_cast<std::ptrdiff_t>(std::clamp(rank, 1.0, static_cast<double>(values.size()))) - 1;
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

}  // namespace darm::client::load
