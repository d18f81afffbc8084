#include "actors/renderer/filter_statistics.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "actors/renderer/display_curve.hpp"

namespace darm::renderer {
namespace {

constexpr float kUnknownVariance = 1e30f;
constexpr float kPooledSamples = 32;
// Noise is judged over a wide neighbourhood: where light is rare and bright, most texels have not met it yet and would
// say that they have none.
constexpr int kNoiseRadius = kMaxSumRadius;
constexpr float kEnoughFreedom = 16;
constexpr float kPriorSamples = 1;    // of a spread as large as the value itself
constexpr float kUsualNoise = 0.06f;  // of one sample of soft light, display units: what `target` is meant for
constexpr float kWideSamples = 4;
constexpr std::uint8_t kRings = 4;
constexpr float kLeastHeld = 0.125f;  // what a corner loses is made up for by a wider filter, within bounds
constexpr float kLeastUnit = 1e-20f;  // nits
constexpr int kSides = kMaxSumRadius + 1;

// A float's exponent and first three bits of mantissa, from 1 on.
constexpr int kClassShift = 20;
constexpr int kFirstClass = std::bit_cast<int>(1.0f) >> kClassShift;

std::uint8_t class_of(float area) {
  if (!(area > 1)) return 0;
  const int bits = std::bit_cast<int>(std::min(area, kMostArea)) + (1 << (kClassShift - 1));
  return static_cast<std::uint8_t>((bits >> kClassShift) - kFirstClass);
}

float slope_at(float linear) { return srgb_slope(std::min<std::uint8_t>(srgb_code(linear), 254)); }

// How far to pool around a texel so that what it is compared by is not noise itself: about kPooledSamples samples.
int pool_radius(float texel_samples) {
  for (const int radius : {1, 3})
    if (static_cast<float>((2 * radius + 1) * (2 * radius + 1)) * texel_samples >= kPooledSamples) return radius;
  return kMaxSumRadius;
}

}  // namespace

float area_of_class(int area_class) { return std::bit_cast<float>((area_class + kFirstClass) << kClassShift); }

// A side that goes on as far as anybody looked is taken to hold its half.
WindowStatistics::WindowStatistics() : side_shares_(static_cast<std::size_t>(kAreaClasses * kSides), 0.5f) {
  for (int c = 1; c < kAreaClasses; ++c)
    for (int side = 0; side + 1 < kSides; ++side)
      side_shares_[static_cast<std::size_t>(c * kSides + side)] =
          0.5f *
          std::erf(std::sqrt(2 * std::numbers::pi_v<float> / area_of_class(c)) * (static_cast<float>(side) + 0.5f));
}

// Share of a Gaussian over the class's area that lies inside of the patch, as its row and column say.
float WindowStatistics::held(int area_class, std::size_t at) const {
  const float* shares = &side_shares_[static_cast<std::size_t>(area_class * kSides)];
  const auto side = [&](std::size_t d) { return shares[static_cast<int>(reach_[d][at])]; };
  return std::max((side(0) + side(1)) * (side(2) + side(3)), kLeastHeld);
}

// That are told apart in a row: what lies behind more walls is one stretch. All patches are in CoarseTex, which has
// 2048 texels a side: under 2^22 of them, and names of their rings' stretches under 2^29.
constexpr std::uint32_t kStretches = 32;

bool WindowStatistics::name_stretches(const FilterWindow& w) {
  row_stretches_ = w.patch;
  column_stretches_ = w.patch;
  if (std::ranges::all_of(w.walls, [](std::uint8_t v) { return v == 0; })) return false;
  std::array<std::uint32_t, kSlotSize + 2 * kMaxFilterRadius> above{};  // walls in each column so far
  for (int y = 0; y < w.size; ++y) {
    std::uint32_t before = 0;
    for (int x = 0; x < w.size; ++x) {
      const auto at = static_cast<std::size_t>(y * w.size + x);
      auto& over = above[static_cast<std::size_t>(x)];
      if ((w.walls[at] & kWallBefore) != 0) ++before;
      if ((w.walls[at] & kWallAbove) != 0) ++over;
      if (w.patch[at] == kNoTexelPatch) continue;
      row_stretches_[at] = w.patch[at] * kStretches + std::min(before, kStretches - 1);
      column_stretches_[at] = w.patch[at] * kStretches + std::min(over, kStretches - 1);
    }
  }
  return true;
}

// What each texel has by itself, in differences to a pivot: no cancellation.
void WindowStatistics::measure(const FilterWindow& w) {
  const auto n = w.count.size();
  double weight = 0, total = 0, texels = 0;
  for (std::size_t i = 0; i < n; ++i) {
    weight += double{w.count[i]};
    total += double{w.count[i]} * double{w.grey[i]};
    texels += w.patch[i] != kNoTexelPatch ? 1.0 : 0.0;
  }
  pivot_ = weight > 0 ? static_cast<float>(total / weight) : 0.0f;
  unit_ = std::max(pivot_, kLeastUnit);
  texel_samples_ = static_cast<float>(weight / std::max(texels, 1.0));
  for (auto* plane : {&own_.samples, &own_.sum, &own_.squares, &own_.within, &own_.freedom}) plane->resize(n);
  const float scale = 1 / unit_;
  for (std::size_t i = 0; i < n; ++i) {
    const float count = w.patch[i] != kNoTexelPatch ? w.count[i] : 0.0f;
    const float difference = count > 0 ? (w.grey[i] - pivot_) * scale : 0.0f;
    own_.samples[i] = count;
    own_.sum[i] = count * difference;
    own_.within[i] = count > 0 ? w.grey_m2[i] * scale * scale : 0.0f;
    own_.squares[i] = count * difference * difference + own_.within[i];
    own_.freedom[i] = std::max(count - 1.0f, 0.0f);
  }
}

// own_ over the neighbourhood of each texel -> around_.
void WindowStatistics::sum_around(PatchSums& patches, int radius, bool within) {
  around_.samples = own_.samples;
  around_.sum = own_.sum;
  around_.squares = own_.squares;
  for (auto* plane : {&around_.samples, &around_.sum, &around_.squares}) patches.sum(*plane, radius);
  if (!within) return;
  around_.within = own_.within;
  around_.freedom = own_.freedom;
  for (auto* plane : {&around_.within, &around_.freedom}) patches.sum(*plane, radius);
}

// Variance of one sample, in units of unit_ squared. Where texels have few samples each, what differs between them
// counts as noise too; later their own samples tell. In a first pass it is the former alone, and as large as the value
// where there is but one sample.
float WindowStatistics::spread_of(std::size_t i, bool first_pass) const {
  const float samples = around_.samples[i];
  const float mean = around_.sum[i] / samples;
  const float m2 = std::max(0.0f, around_.squares[i] - mean * around_.sum[i]);
  const float value = pivot_ / unit_ + mean;
  if (first_pass) return samples > 1.5f ? m2 / (samples - 1.0f) : value * value;
  const float between = (m2 + kPriorSamples * value * value) / (samples - 1.0f + kPriorSamples);
  const float freedom = around_.freedom[i];
  const float trust = freedom / (freedom + kEnoughFreedom);
  const float inside = freedom > 0 ? around_.within[i] / freedom : 0.0f;
  return trust * inside + (1.0f - trust) * between;
}

// Names each texel by stretch and ring: gutter, outermost texels, those beside them, all others.
void WindowStatistics::ring(const FilterWindow& w) {
  const int size = w.size;
  const auto n = w.count.size();
  depth_.assign(n, kRings - 1);
  for (int y = 0; y < size; ++y)
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, size - 1); ++v)
      for (int du = -1; du <= 1; ++du) {
        const int begin = std::max(0, -du), end = std::min(size, size - du);
        const std::uint32_t* own = &w.patch[static_cast<std::size_t>(y * size)];
        const std::uint32_t* other = &w.patch[static_cast<std::size_t>(v * size + du + begin)] - begin;
        std::uint8_t* depth = &depth_[static_cast<std::size_t>(y * size)];
        for (int x = begin; x < end; ++x) depth[x] = own[x] == other[x] ? depth[x] : std::uint8_t{0};
      }
  // One ring further in at each round: rows, then columns.
  row_rings_.resize(n);
  column_rings_.resize(n);
  for (std::uint8_t ring = 1; ring + 1 < kRings; ++ring) {
    least_ = depth_;
    for (int y = 0; y < size; ++y) {
      const std::uint8_t* from = &depth_[static_cast<std::size_t>(y * size)];
      std::uint8_t* to = &least_[static_cast<std::size_t>(y * size)];
      for (int x = 1; x + 1 < size; ++x) to[x] = std::min({from[x - 1], from[x], from[x + 1]});
      to[0] = std::min(from[0], from[1]);
      to[size - 1] = std::min(from[size - 2], from[size - 1]);
    }
    for (int y = 0; y < size; ++y) {
      const auto row = [&](int v) { return &least_[static_cast<std::size_t>(std::clamp(v, 0, size - 1) * size)]; };
      const std::uint8_t *a = row(y - 1), *b = row(y), *c = row(y + 1);
      std::uint8_t* to = &depth_[static_cast<std::size_t>(y * size)];
      for (int x = 0; x < size; ++x) {
        const bool beside = std::min({a[x], b[x], c[x]}) < ring;
        to[x] = to[x] >= ring && beside ? ring : to[x];
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    const bool nobody = w.patch[i] == kNoTexelPatch;
    row_rings_[i] = nobody ? kNoTexelPatch : row_stretches_[i] * kRings + depth_[i];
    column_rings_[i] = nobody ? kNoTexelPatch : column_stretches_[i] * kRings + depth_[i];
  }
}

void WindowStatistics::compare_neighbours(const FilterWindow& w) {
  constexpr std::size_t kSums = 8;  // side by side, so that they vectorise
  const std::size_t n = w.count.size();
  for (auto* plane : {&noise_, &tinted_, &inside_}) plane->resize(n);  // not in use yet
  auto &mean = noise_, &variance = tinted_, &known = inside_;
  for (std::size_t i = 0; i < n; ++i) {
    const float count = own_.samples[i];
    mean[i] = own_.sum[i] / std::max(count, 1.0f);
    variance[i] = own_.within[i] / std::max(count * (count - 1), 1.0f);
    known[i] = count >= 2 ? 1.0f : 0.0f;
  }
  std::array<float, kSums> measured{}, said{};
  for (const std::size_t step :
       {std::size_t{1}, static_cast<std::size_t>(w.size)})  // a row's end counts too: no matter
    for (std::size_t i = 0; i + step + kSums <= n; i += kSums)
      for (std::size_t k = 0; k < kSums; ++k) {
        const std::size_t a = i + k, b = a + step;
        const float both = known[a] * known[b];
        const float pair = w.patch[a] == w.patch[b] ? both : 0.0f;
        const float difference = mean[a] - mean[b];
        measured[k] += pair * difference * difference;
        said[k] += pair * (variance[a] + variance[b]);
      }
  double all_measured = 0, all_said = 0;
  for (std::size_t k = 0; k < kSums; ++k) {
    all_measured += double{measured[k]};
    all_said += double{said[k]};
  }
  evenness_ = all_measured < all_said ? static_cast<float>(all_measured / all_said) : 1.0f;
}

void WindowStatistics::compare_by(const FilterWindow& w, bool first_pass) {
  const auto n = w.count.size();
  mean_.assign(n, 0.0f);
  variance_.assign(n, kUnknownVariance);  // like everything
  spread_.assign(n, 0.0f);
  inside_.assign(n, 0.0f);
  const float square = unit_ * unit_;
  for (std::size_t i = 0; i < n; ++i) {
    const float samples = around_.samples[i];
    if (samples < 0.5f) continue;
    mean_[i] = pivot_ + unit_ * (around_.sum[i] / samples);
    const float own = spread_of(i, first_pass);
    // Few samples say little of their spread, and where light is rare most say there is none: the neighbourhood joins
    // in.
    const float joined = first_pass ? own : (samples * own + kWideSamples * wide_[i]) / (samples + kWideSamples);
    spread_[i] = square * joined;
    variance_[i] = spread_[i] / samples;
    if (first_pass)
      inside_[i] = spread_[i];
    else if (around_.freedom[i] > 0)
      inside_[i] = square * (around_.within[i] / around_.freedom[i]);
  }
}

// A wall is no border here: light changes so much beside it that a wider filter would smear more than it evens out.
void WindowStatistics::widen(const FilterWindow& w, PatchSums& stretches, float target) {
  const auto n = w.count.size();
  by_patch_.reach(reach_);
  noise_.assign(n, 0.0f);
  tinted_.assign(n, 0.0f);
  for (std::size_t i = 0; i < n; ++i) {
    if (w.patch[i] == kNoTexelPatch || !(w.tint[i] > 0)) continue;
    const float slope = slope_at(w.floor[i] + w.tint[i] * mean_[i]) * w.tint[i];
    tinted_[i] = 1;
    noise_[i] = slope * slope * spread_[i];
  }
  stretches.sum(noise_, kNoiseRadius);
  stretches.sum(tinted_, kNoiseRadius);
  for (std::size_t i = 0; i < n; ++i) {
    if (!(wide_count_[i] > 0)) continue;
    float area = target / std::max(w.count[i], wide_count_[i]);
    if (tinted_[i] > 0.5f) area *= noise_[i] / (tinted_[i] * (kUsualNoise * kUsualNoise));
    const int alone = class_of(area);
    if (alone == 0) continue;
    area_class_[i] = class_of(area / held(alone, i));
    widest_class_ = std::max<int>(widest_class_, area_class_[i]);
  }
}

void WindowStatistics::run(const FilterWindow& w, float target) {
  const auto n = w.count.size();
  measure(w);
  by_patch_.connect(w.patch, w.patch, w.size, kNoTexelPatch);
  const bool walled = name_stretches(w);
  if (walled) by_stretch_.connect(row_stretches_, column_stretches_, w.size, kNoTexelPatch);
  PatchSums& stretches = walled ? by_stretch_ : by_patch_;
  area_class_.assign(n, 0);
  widest_class_ = 0;
  evenness_ = 1;
  if (w.first_pass()) {
    sum_around(stretches, pool_radius(texel_samples_), false);
    compare_by(w, true);
    for (std::size_t i = 0; i < n; ++i) area_class_[i] = class_of(target / std::max(w.count[i], 1.0f));
    widest_class_ = n > 0 ? *std::max_element(area_class_.begin(), area_class_.end()) : 0;
    return;
  }
  sum_around(stretches, kNoiseRadius, true);
  wide_.assign(n, 0.0f);
  wide_count_.assign(n, 0.0f);
  for (std::size_t i = 0; i < n; ++i) {
    if (around_.samples[i] < 0.5f) continue;
    wide_[i] = spread_of(i, false);
    wide_count_[i] = around_.samples[i] / std::max(around_.samples[i] - around_.freedom[i], 1.0f);
  }
  compare_neighbours(w);
  ring(w);
  by_ring_.connect(row_rings_, column_rings_, w.size, kNoTexelPatch);
  sum_around(by_ring_, pool_radius(texel_samples_), true);
  compare_by(w, false);
  widen(w, stretches, target);
}

}  // namespace darm::renderer
