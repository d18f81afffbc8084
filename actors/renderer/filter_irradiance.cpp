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
  for (auto& plane : trust) plane.assign(n, 0.0f);
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

// Mean and variance of all samples in the 3x3 neighbourhood of the same patch: Chan's formula over texels, which also
// gives a spread where each texel has but one sample.
void IrradianceFilter::pool(const FilterWindow& w) {
  const auto n = w.count.size();
  pooled_.assign(n, 0.0f);
  pooled_variance_.assign(n, 0.0f);
  texel_variance_.assign(n, 0.0f);
  for (int y = 0; y < w.size; ++y)
    for (int x = 0; x < w.size; ++x) {
      const auto at = static_cast<std::size_t>(y * w.size + x);
      if (w.count[at] <= 0) continue;
      float samples = 0;
      float sum = 0;
      float squares = 0;
      float m2 = 0;
      const float pivot = w.grey[at];  // differences to the centre: no cancellation
      for (int dy = y > 0 ? -1 : 0; dy <= (y + 1 < w.size ? 1 : 0); ++dy)
        for (int dx = x > 0 ? -1 : 0; dx <= (x + 1 < w.size ? 1 : 0); ++dx) {
          const auto other = static_cast<std::size_t>((y + dy) * w.size + x + dx);
          if (w.patch[other] != w.patch[at]) continue;
          const float c = w.count[other];
          const float d = w.grey[other] - pivot;
          samples += c;
          sum += c * d;
          squares += c * d * d;
          m2 += w.grey_m2[other];
        }
      const float mean = sum / samples;
      m2 += std::max(0.0f, squares - mean * sum);
      // A single sample says nothing of its spread: take it as large as the value itself.
      const float spread = samples > 1.5f ? m2 / (samples - 1.0f) : (pivot + mean) * (pivot + mean);
      pooled_[at] = pivot + mean;
      pooled_variance_[at] = spread / samples;
      texel_variance_[at] = spread / w.count[at];
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
      if (w.count[at] <= 0) continue;
      const float* table = weights_of(at);
      Row& row = rows_[static_cast<std::size_t>(y * kSlotSize + x)];
      for (int d = -r; d <= r; ++d) {
        const float g = d == 0 ? 1.0f : table[std::abs(d)];
        const auto q = at + static_cast<std::size_t>(d);
        if (g == 0 || w.count[q] <= 0 || w.patch[q] != w.patch[at]) continue;
        const float k =
            d == 0 ? 1.0f : g * likeness(pooled_[q] - pooled_[at], pooled_variance_[q] + pooled_variance_[at]);
        for (std::size_t c = 0; c < 3; ++c) {
          row.irradiance[c] += k * w.trust[c][q] * w.irradiance[c][q];
          row.trust[c] += k * w.trust[c][q];
        }
        const float kn = k * w.count[q];
        row.weight += kn;
        row.variance += kn * kn * texel_variance_[q];
      }
      for (std::size_t c = 0; c < 3; ++c)
        if (row.trust[c] > 0) row.irradiance[c] /= row.trust[c];
      row.variance /= row.weight * row.weight;  // the centre alone gives weight >= 1
    }

  out.assign(kSlotTexels, FilteredTexel{});
  for (int y = 0; y < kSlotSize; ++y)
    for (int x = 0; x < kSlotSize; ++x) {
      const auto at = static_cast<std::size_t>((y + r) * w.size + x + r);
      if (w.count[at] <= 0) continue;
      const float* table = weights_of(at);
      FilteredTexel& texel = out[static_cast<std::size_t>(y * kSlotSize + x)];
      std::array<float, 3> trust{};
      float weight = 0;
      for (int d = -r; d <= r; ++d) {
        const float g = d == 0 ? 1.0f : table[std::abs(d)];
        const auto q = static_cast<std::size_t>(static_cast<int>(at) + d * w.size);
        if (g == 0 || w.count[q] <= 0 || w.patch[q] != w.patch[at]) continue;
        const float k =
            d == 0 ? 1.0f : g * likeness(pooled_[q] - pooled_[at], pooled_variance_[q] + pooled_variance_[at]);
        const Row& row = rows_[static_cast<std::size_t>((y + r + d) * kSlotSize + x)];
        for (std::size_t c = 0; c < 3; ++c) {
          texel.irradiance[c] += k * row.trust[c] * row.irradiance[c];
          trust[c] += k * row.trust[c];
        }
        const float kn = k * row.weight;
        weight += kn;
        texel.variance += kn * kn * row.variance;
      }
      for (std::size_t c = 0; c < 3; ++c)
        if (trust[c] > 0) texel.irradiance[c] /= trust[c];
      texel.variance /= weight * weight;
      texel.known = true;
    }
}

}  // namespace darm::renderer
