#include "actors/renderer/filter_irradiance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "actors/types/tile_id.hpp"

namespace darm::renderer {

namespace {

constexpr int kCounts = 512;  // weights are tabled up to here; more samples want no filter
constexpr int kStride = kMaxFilterRadius + 1;
constexpr float kLeastWeight = 0.02f;
constexpr std::uint32_t kNone = 0xffffffffu;  // texel of no patch
constexpr float kUnknownVariance = 1e30f;
constexpr float kLeastSum = 1e-6f;  // of weights times counts: its square is divided by
constexpr int kMaxPoolRadius = 5;
constexpr double kPooledSamples = 32;

// A 2D Gaussian averages over 4 pi sigma^2 texels, so sigma^2 = target / (4 pi n).
float gaussian(float distance, float count, float target) {
  return std::exp(-distance * distance * 2.0f * std::numbers::pi_v<float> * count / target);
}

// 1 when alike within the noise, 1/2 at 2.5 standard errors, falling with the fourth power.
float likeness(float difference, float variance) {
  const float x = difference * difference / (6.25f * variance + 1e-30f);
  return 1.0f / (1.0f + x * x);
}

}  // namespace

void FilterWindow::reset(int new_radius) {
  radius = std::clamp(new_radius, 0, kMaxFilterRadius);
  size = kSlotSize + 2 * radius;
  const auto n = static_cast<std::size_t>(size * size);
  patch.assign(n, 0xffffffffu);
  for (auto* plane : {&count, &grey, &grey_m2}) plane->assign(n, 0.0f);
  for (auto& plane : irradiance) plane.assign(n, 0.0f);
}

int filter_radius(float count, float target) {
  if (!(count > 0) || count >= target) return 0;
  int radius = 0;
  while (radius < kMaxFilterRadius && gaussian(static_cast<float>(radius + 1), count, target) >= kLeastWeight) ++radius;
  return radius;
}

void IrradianceFilter::prepare_weights(float target) {
  if (weights_target_ == target) return;
  weights_target_ = target;
  weights_.assign(static_cast<std::size_t>(kCounts * kStride), 0.0f);
  for (int n = 1; n < kCounts; ++n) {
    const int radius = filter_radius(static_cast<float>(n), target);
    for (int d = 0; d <= radius; ++d)
      weights_[static_cast<std::size_t>(n * kStride + d)] =
          gaussian(static_cast<float>(d), static_cast<float>(n), target);
  }
}

// How far to pool around a texel so that what it is compared by is not noise itself: about kPooledSamples samples.
int IrradianceFilter::pool_radius(const FilterWindow& w) {
  double samples = 0;
  double texels = 0;
  for (std::size_t i = 0; i < w.count.size(); ++i) {
    samples += double{w.count[i]};
    texels += w.patch[i] != kNone ? 1.0 : 0.0;
  }
  const double each = texels > 0 ? samples / texels : 0.0;
  int radius = 1;
  while (radius < kMaxPoolRadius && (2 * radius + 1) * (2 * radius + 1) * each < kPooledSamples) ++radius;
  return radius;
}

// Mean and variance of all samples of the same patch around each texel: Chan's formula over texels, which also gives a
// spread where each texel has but one sample. Rows first, then columns of rows: a square, but for patches that wind.
void IrradianceFilter::pool(const FilterWindow& w) {
  const auto n = w.count.size();
  const int radius = pool_radius(w);
  double weight = 0;
  double total = 0;
  for (std::size_t i = 0; i < n; ++i) {
    weight += double{w.count[i]};
    total += double{w.count[i]} * double{w.grey[i]};
  }
  const float pivot = weight > 0 ? static_cast<float>(total / weight) : 0.0f;  // sums of differences: no cancellation
  pool_rows_.assign(n, PoolSum{});
  const auto reach = [&](int at, const auto& visit) {
    for (int d = -std::min(radius, at); d <= std::min(radius, w.size - 1 - at); ++d) visit(d);
  };
  for (int y = 0; y < w.size; ++y)
    for (int x = 0; x < w.size; ++x) {
      const auto at = static_cast<std::size_t>(y * w.size + x);
      if (w.patch[at] == kNone) continue;
      PoolSum& sum = pool_rows_[at];
      reach(x, [&](int d) {
        const auto other = at + static_cast<std::size_t>(d);
        if (w.patch[other] != w.patch[at]) return;
        const float difference = w.grey[other] - pivot;
        sum.samples += w.count[other];
        sum.sum += w.count[other] * difference;
        sum.squares += w.count[other] * difference * difference + w.grey_m2[other];
      });
    }
  pooled_.assign(n, 0.0f);
  pooled_variance_.assign(n, kUnknownVariance);  // like everything
  texel_variance_.assign(n, 0.0f);
  for (int y = 0; y < w.size; ++y)
    for (int x = 0; x < w.size; ++x) {
      const auto at = static_cast<std::size_t>(y * w.size + x);
      if (w.patch[at] == kNone) continue;
      PoolSum all;
      reach(y, [&](int d) {
        const auto other = static_cast<std::size_t>((y + d) * w.size + x);
        if (w.patch[other] != w.patch[at]) return;
        all.samples += pool_rows_[other].samples;
        all.sum += pool_rows_[other].sum;
        all.squares += pool_rows_[other].squares;
      });
      if (all.samples <= 0) continue;
      const float mean = all.sum / all.samples;
      const float m2 = std::max(0.0f, all.squares - mean * all.sum);
      // A single sample says nothing of its spread: take it as large as the value itself.
      const float spread = all.samples > 1.5f ? m2 / (all.samples - 1.0f) : (pivot + mean) * (pivot + mean);
      pooled_[at] = pivot + mean;
      pooled_variance_[at] = spread / all.samples;
      texel_variance_[at] = w.count[at] > 0 ? spread / w.count[at] : 0.0f;
    }
}

void IrradianceFilter::run(const FilterWindow& w, float target, std::vector<FilteredTexel>& out) {
  prepare_weights(target);
  pool(w);
  const int r = w.radius;
  rows_.assign(static_cast<std::size_t>(w.size * kSlotSize), Row{});
  const auto weights_of = [&](std::size_t at) {
    const auto n = std::min(static_cast<int>(w.count[at]), kCounts - 1);
    return &weights_[static_cast<std::size_t>(std::max(n, 1) * kStride)];
  };

  for (int y = 0; y < w.size; ++y)
    for (int x = 0; x < kSlotSize; ++x) {
      const auto at = static_cast<std::size_t>(y * w.size + x + r);
      if (w.patch[at] == kNone) continue;
      const float* table = weights_of(at);
      Row& row = rows_[static_cast<std::size_t>(y * kSlotSize + x)];
      for (int d = -r; d <= r; ++d) {
        const float g = d == 0 ? 1.0f : table[std::abs(d)];
        const auto q = at + static_cast<std::size_t>(d);
        if (g == 0 || w.count[q] <= 0 || w.patch[q] != w.patch[at]) continue;
        const float k =
            d == 0 ? 1.0f : g * likeness(pooled_[q] - pooled_[at], pooled_variance_[q] + pooled_variance_[at]);
        const float kn = k * w.count[q];
        for (std::size_t c = 0; c < 3; ++c) row.irradiance[c] += kn * w.irradiance[c][q];
        row.weight += kn;
        row.variance += kn * kn * texel_variance_[q];
      }
      if (row.weight < kLeastSum) continue;
      for (float& channel : row.irradiance) channel /= row.weight;
      row.variance /= row.weight * row.weight;
    }

  out.assign(kSlotTexels, FilteredTexel{});
  for (int y = 0; y < kSlotSize; ++y)
    for (int x = 0; x < kSlotSize; ++x) {
      const auto at = static_cast<std::size_t>((y + r) * w.size + x + r);
      if (w.patch[at] == kNone) continue;
      const float* table = weights_of(at);
      FilteredTexel& texel = out[static_cast<std::size_t>(y * kSlotSize + x)];
      float weight = 0;
      for (int d = -r; d <= r; ++d) {
        const float g = d == 0 ? 1.0f : table[std::abs(d)];
        const auto q = static_cast<std::size_t>(static_cast<int>(at) + d * w.size);
        if (g == 0 || w.patch[q] != w.patch[at]) continue;
        const float k =
            d == 0 ? 1.0f : g * likeness(pooled_[q] - pooled_[at], pooled_variance_[q] + pooled_variance_[at]);
        const Row& row = rows_[static_cast<std::size_t>((y + r + d) * kSlotSize + x)];
        const float kn = k * row.weight;
        for (std::size_t c = 0; c < 3; ++c) texel.irradiance[c] += kn * row.irradiance[c];
        weight += kn;
        texel.variance += kn * kn * row.variance;
      }
      if (weight < kLeastSum) continue;
      for (float& channel : texel.irradiance) channel /= weight;
      texel.variance /= weight * weight;
      texel.known = true;
    }
}

}  // namespace darm::renderer
