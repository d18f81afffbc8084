#include "actors/renderer/outliers.hpp"

#include <algorithm>
#include <vector>

namespace darm::renderer {
namespace {

constexpr int kReach = 2;
constexpr float kFewNeighbours = 4;  // samples; fewer say nothing about what is usual

// Mean of the other texels' samples around `at`; negative if there are too few.
float usual_around(const FilterWindow& w, const std::vector<float>& grey, int x, int y) {
  const auto at = static_cast<std::size_t>(y * w.size + x);
  float samples = 0;
  float sum = 0;
  for (int v = std::max(0, y - kReach); v <= std::min(w.size - 1, y + kReach); ++v)
    for (int u = std::max(0, x - kReach); u <= std::min(w.size - 1, x + kReach); ++u) {
      const auto other = static_cast<std::size_t>(v * w.size + u);
      if (other == at || w.patch[other] != w.patch[at]) continue;
      samples += w.count[other];
      sum += w.count[other] * grey[other];
    }
  return samples < kFewNeighbours ? -1.0f : sum / samples;
}

}  // namespace

float outlier_bound(float count) { return 2.0f + count / 8.0f; }

void tame_outliers(FilterWindow& w) {
  const std::vector<float> grey = w.grey;  // judged by what was measured, not by what was tamed
  double samples = 0;
  double sum = 0;
  for (std::size_t at = 0; at < grey.size(); ++at) {
    samples += w.count[at];
    sum += double{w.count[at]} * grey[at];
  }
  if (samples <= 0) return;
  // Most texels are below the window's mean and need no look around them.
  const auto suspicious = static_cast<float>(sum / samples);
  for (int y = 0; y < w.size; ++y)
    for (int x = 0; x < w.size; ++x) {
      const auto at = static_cast<std::size_t>(y * w.size + x);
      if (w.count[at] <= 0 || w.count[at] >= kOutlierSamples || grey[at] <= suspicious) continue;
      const float usual = usual_around(w, grey, x, y);
      const float bound = usual * outlier_bound(w.count[at]);
      if (usual < 0 || grey[at] <= bound) continue;
      const float scale = bound / grey[at];  // grey > bound >= 0
      for (auto& channel : w.irradiance) channel[at] *= scale;
      w.grey[at] *= scale;
      w.grey_m2[at] *= scale * scale;
    }
}

}  // namespace darm::renderer
