#include "actors/renderer/outliers.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
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

// What was taken from texels of one patch.
struct Taken {
  std::uint32_t patch = 0;
  float texels = 0;  // that have samples: among these it is shared out
  float left = 0;    // grey of these, once tamed
  std::array<float, 3> irradiance{};
  float grey = 0;
  double lost = 0;  // `grey`, and what each texel lost squared: exact for one texel
  double squares = 0;
};

Taken& of_patch(std::vector<Taken>& all, std::uint32_t patch) {
  const auto found = std::ranges::find(all, patch, &Taken::patch);
  return found != all.end() ? *found : all.emplace_back(Taken{.patch = patch});
}

// Evenly over the patch's texels in the window: rooms that are lit by a small bright spot have most of their light in
// rare samples, and would stay a fifth too dark for as long as these are held down. What is not trusted is lost until
// there are more samples; w.held_down has it all.
void share_out(FilterWindow& w, std::vector<Taken>& all) {
  if (all.empty()) return;  // nearly always
  const auto each = [&](const auto& visit) {
    for (std::size_t at = 0; at < w.grey.size(); ++at) {
      if (w.count[at] <= 0) continue;
      const auto taken = std::ranges::find(all, w.patch[at], &Taken::patch);
      if (taken != all.end()) visit(*taken, at);
    }
  };
  each([&](Taken& taken, std::size_t at) {
    ++taken.texels;
    taken.left += w.grey[at];
  });
  for (auto& taken : all) {
    const float share = share_to_trust(taken.lost, taken.squares, double{taken.left}) / taken.texels;
    for (auto& channel : taken.irradiance) channel *= share;
    taken.grey *= share;
  }
  each([&](const Taken& taken, std::size_t at) {
    for (std::size_t c = 0; c < 3; ++c) w.irradiance[c][at] += taken.irradiance[c];
    w.grey[at] += taken.grey;
  });
}

}  // namespace

float share_to_trust(double taken, double squares, double left) {
  if (!(taken > 0)) return 1;
  const double sure = std::max(1 - squares / (taken * taken), 0.0);
  return static_cast<float>(std::min(1.0, sure + left / taken));
}

float outlier_bound(float count) { return 2.0f + 24.0f / count + count / 64.0f; }

void tame_outliers(FilterWindow& w) {
  const Around around = look_around(w);  // judged by what was measured, not by what was tamed
  double taken = 0;
  int texels = 0;
  std::vector<Taken> by_patch;
  for (std::size_t at = 0; at < w.grey.size(); ++at) {
    texels += w.count[at] > 0 ? 1 : 0;
    if (w.count[at] <= 0 || w.count[at] >= kOutlierSamples || around.samples[at] < kFewNeighbours) continue;
    const float bound = around.sum[at] / around.samples[at] * outlier_bound(w.count[at]);
    if (w.grey[at] <= bound) continue;
    const float scale = bound / w.grey[at];  // grey > bound >= 0
    taken += double{w.grey[at]} - double{bound};
    auto& own = of_patch(by_patch, w.patch[at]);
    const float lost = w.grey[at] - bound;
    own.grey += lost;
    own.lost += double{lost};
    own.squares += double{lost} * double{lost};
    for (std::size_t c = 0; c < 3; ++c) {
      own.irradiance[c] += w.irradiance[c][at] * (1 - scale);
      w.irradiance[c][at] *= scale;
    }
    w.grey[at] *= scale;
    w.grey_m2[at] *= scale * scale;
  }
  share_out(w, by_patch);
  w.held_down = static_cast<float>(taken / std::max(texels, 1));
}

}  // namespace darm::renderer
