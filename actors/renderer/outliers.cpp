#include "actors/renderer/outliers.hpp"

#include <algorithm>

#include "actors/renderer/tile_surface.hpp"

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

void add_offset(const LightSquare& s, int du, int dv, Around& around) {
  const int begin = std::max(0, -du);
  const auto length = static_cast<std::size_t>(std::min(s.size, s.size - du) - begin);
  for (int y = std::max(0, -dv); y < std::min(s.size, s.size - dv); ++y) {
    const auto own = static_cast<std::size_t>(y * s.size + begin);
    const auto other = static_cast<std::size_t>((y + dv) * s.size + begin + du);
    const std::uint32_t* patch = s.patch.data() + own;
    const std::uint32_t* other_patch = s.patch.data() + other;
    const float* count = s.count.data() + other;
    const float* grey = s.grey.data() + other;
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

Around look_around(const LightSquare& s) {
  Around around{std::vector<float>(s.grey.size()), std::vector<float>(s.grey.size())};
  for (int dv = -kReach; dv <= kReach; ++dv)
    for (int du = -kReach; du <= kReach; ++du)
      if (du != 0 || dv != 0) add_offset(s, du, dv, around);
  return around;
}

}  // namespace

void LightSquare::reset(int new_size) {
  size = new_size;
  const auto n = static_cast<std::size_t>(size * size);
  patch.assign(n, kNobody);
  count.assign(n, 0.0f);
  grey.assign(n, 0.0f);
}

float outlier_bound(float count) { return 2.0f + 24.0f / count + count / 64.0f; }

void find_outliers(const LightSquare& s, std::vector<Outlier>& found) {
  found.clear();
  const Around around = look_around(s);  // judged by what was measured, not by what was tamed
  for (std::size_t at = 0; at < s.grey.size(); ++at) {
    if (s.count[at] <= 0 || s.count[at] >= kOutlierSamples || around.samples[at] < kFewNeighbours) continue;
    const float bound = around.sum[at] / around.samples[at] * outlier_bound(s.count[at]);
    if (s.grey[at] > bound) found.push_back({at, bound / s.grey[at]});  // grey > bound >= 0
  }
}

}  // namespace darm::renderer
