#include "actors/renderer/outliers.hpp"

#include <algorithm>
#include <vector>

namespace darm::renderer {
namespace {

constexpr int kReach = 2;
constexpr float kFewNeighbours = 4;  // samples; fewer say nothing about what is usual

// What the other texels of its patch within reach have, for every texel. One offset at a time over whole rows: such
// loops vectorise, so that no texel needs to be left out for the sake of time.
struct Around {
  std::vector<float> samples;
  std::vector<float> sum;  // of samples times grey
};

void add_offset(const FilterWindow& w, int du, int dv, Around& around) {
  const int begin = std::max(0, -du);
  const auto length = static_cast<std::size_t>(std::min(w.size, w.size - du) - begin);
  for (int y = std::max(0, -dv); y < std::min(w.size, w.size - dv); ++y) {
    const auto own = static_cast<std::size_t>(y * w.size + begin);
    const auto other = static_cast<std::size_t>((y + dv) * w.size + begin + du);
    const std::uint32_t* patch = w.patch.data() + own;
    const std::uint32_t* other_patch = w.patch.data() + other;
    const float* count = w.count.data() + other;
    const float* grey = w.grey.data() + other;
    float* samples = around.samples.data() + own;
    float* sum = around.sum.data() + own;
    for (std::size_t i = 0; i < length; ++i) {
      const float all = count[i];  // read always, or the loop does not vectorise
      const float same = other_patch[i] == patch[i] ? all : 0.0f;
      samples[i] += same;
      sum[i] += same * grey[i];
    }
  }
}

Around look_around(const FilterWindow& w) {
  Around around{std::vector<float>(w.grey.size()), std::vector<float>(w.grey.size())};
  for (int dv = -kReach; dv <= kReach; ++dv)
    for (int du = -kReach; du <= kReach; ++du)
      if (du != 0 || dv != 0) add_offset(w, du, dv, around);
  return around;
}

}  // namespace

float outlier_bound(float count) { return 2.0f + 24.0f / count + count / 64.0f; }

void tame_outliers(FilterWindow& w) {
  const Around around = look_around(w);  // judged by what was measured, not by what was tamed
  double taken = 0;
  int texels = 0;
  for (std::size_t at = 0; at < w.grey.size(); ++at) {
    texels += w.count[at] > 0 ? 1 : 0;
    if (w.count[at] <= 0 || w.count[at] >= kOutlierSamples || around.samples[at] < kFewNeighbours) continue;
    const float bound = around.sum[at] / around.samples[at] * outlier_bound(w.count[at]);
    if (w.grey[at] <= bound) continue;
    const float scale = bound / w.grey[at];  // grey > bound >= 0
    taken += double{w.grey[at]} - double{bound};
    for (auto& channel : w.irradiance) channel[at] *= scale;
    w.grey[at] *= scale;
    w.grey_m2[at] *= scale * scale;
  }
  w.held_down = static_cast<float>(taken / std::max(texels, 1));
}

}  // namespace darm::renderer
