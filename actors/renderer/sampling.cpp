#include "actors/renderer/sampling.hpp"

namespace darm::renderer {

AliasTable::AliasTable(const std::vector<double>& weights) {
  double sum = 0;
  for (const double w : weights) sum += w;
  if (!(sum > 0)) return;
  const std::size_t n = weights.size();
  entries_.resize(n);
  std::vector<double> share(n);
  std::vector<std::uint32_t> small, large;
  for (std::size_t i = 0; i < n; ++i) {
    entries_[i].probability = static_cast<float>(weights[i] / sum);
    share[i] = weights[i] / sum * static_cast<double>(n);
    (share[i] < 1 ? small : large).push_back(static_cast<std::uint32_t>(i));
  }
  while (!small.empty() && !large.empty()) {
    const auto s = small.back();
    const auto l = large.back();
    small.pop_back();
    entries_[s].keep = static_cast<float>(share[s]);
    entries_[s].alias = l;
    share[l] -= 1.0 - share[s];
    if (share[l] < 1) {
      large.pop_back();
      small.push_back(l);
    }
  }
  // What is left is 1 but for rounding. An impossible entry must not become drawable that way.
  for (const auto i : small) entries_[i].alias = i;
  for (const auto i : large) entries_[i].alias = i;
}

}  // namespace darm::renderer
