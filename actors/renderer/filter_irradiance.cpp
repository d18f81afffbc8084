#include "actors/renderer/filter_irradiance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace darm::renderer {

namespace {

constexpr float kLeastWeight = 0.02f;

// A 2D Gaussian averages over 4 pi sigma^2 texels.
float gaussian(float distance, float area) {
  return std::exp(-distance * distance * 2.0f * std::numbers::pi_v<float> / area);
}

}  // namespace

IrradianceFilter::IrradianceFilter() {
  for (std::size_t c = 1; c < kAreaClasses; ++c) {
    const float area = area_of_class(static_cast<int>(c));
    if (gaussian(1, area) < kLeastWeight) continue;
    firsts_[c] = gaussian(1, area);
    while (reaches_[c] < kMaxFilterRadius && gaussian(static_cast<float>(reaches_[c] + 1), area) >= kLeastWeight)
      ++reaches_[c];
  }
}

FitCentres IrradianceFilter::centres_at(const std::vector<std::uint32_t>& stretches, std::size_t first) const {
  return {load(&stretches[first]), load(&statistics_.mean()[first]), load(&statistics_.variance()[first]),
          load(&first_[first])};
}

// Of the kLanes texels from `first` on.
int IrradianceFilter::reach_of(std::size_t first) const {
  const auto* classes = &statistics_.area_class()[first];
  return reaches_[*std::max_element(classes, classes + kLanes)];
}

void IrradianceFilter::prepare(const FilterWindow& w) {
  const std::size_t n = w.count.size();
  variance_.resize(n);
  first_.resize(n);
  const auto& spread = statistics_.spread();
  for (std::size_t i = 0; i < n; ++i) variance_[i] = spread[i] / std::max(w.count[i], 1.0f);
  for (std::size_t i = 0; i < n; ++i) first_[i] = firsts_[statistics_.area_class()[i]];
}

// Most of a tile is often seen by nobody: what has no samples is passed over, kLanes texels at a time.
void IrradianceFilter::find_lit(const FilterWindow& w) {
  lit_.assign(w.count.size(), 0);
  for (int y = 0; y < w.size; ++y) {
    int dark = kLanes;  // texels without samples from here on
    for (int x = w.size - 1; x >= 0; --x) {
      const auto at = static_cast<std::size_t>(y * w.size + x);
      dark = w.count[at] > 0 ? 0 : dark + 1;
      lit_[at] = dark < kLanes ? 1 : 0;
    }
  }
}

void IrradianceFilter::filter_rows(const FilterWindow& w) {
  const auto& stretches = statistics_.row_stretches();
  rows_.resize(static_cast<std::size_t>(w.size * kBlocks));
  filled_.assign(rows_.size(), 0);
  for (int y = 0; y < w.size; ++y)
    for (int b = 0; b < kBlocks; ++b) {
      const auto first = static_cast<std::size_t>(y * w.size + w.radius + b * kLanes);
      const int reach = std::min(reach_of(first), w.radius);
      LineFits fits(centres_at(stretches, first), with_slope_);
      bool any = false;
      fits.along(reach, [&](int distance) {
        const std::size_t q = first + static_cast<std::size_t>(distance);
        if (lit_[q] == 0) return;
        any = true;
        fits.add({load(&stretches[q]),
                  load(&statistics_.mean()[q]),
                  load(&statistics_.variance()[q]),
                  load(&w.count[q]),
                  {load(&w.irradiance[0][q]), load(&w.irradiance[1][q]), load(&w.irradiance[2][q])},
                  load(&variance_[q])},
                 static_cast<float>(distance));
      });
      if (!any) continue;
      filled_[static_cast<std::size_t>(y * kBlocks + b)] = 1;
      fits.solve(&w.count[first], block(y, b));
    }
}

void IrradianceFilter::filter_columns(const FilterWindow& w, std::vector<FilteredTexel>& out) {
  const auto& stretches = statistics_.column_stretches();
  Fitted fitted;
  for (int y = 0; y < kSlotSize; ++y)
    for (int b = 0; b < kBlocks; ++b) {
      const auto first = static_cast<std::size_t>((y + w.radius) * w.size + w.radius + b * kLanes);
      const int reach = std::min(reach_of(first), w.radius);
      LineFits fits(centres_at(stretches, first), with_slope_);
      bool any = false;
      fits.along(reach, [&](int distance) {
        const int v = y + w.radius + distance;
        if (filled_[static_cast<std::size_t>(v * kBlocks + b)] == 0) return;
        any = true;
        const auto q = static_cast<std::size_t>(v * w.size + w.radius + b * kLanes);
        const Fitted& row = block(v, b);
        fits.add({load(&stretches[q]), load(&statistics_.mean()[q]), load(&statistics_.variance()[q]), row.weight,
                  row.value, row.noise},
                 static_cast<float>(distance));
      });
      if (!any) continue;
      fits.solve(&w.count[first], fitted);
      for (std::size_t x = 0; x < kLanes; ++x) {
        if (w.patch[first + x] == kNoTexelPatch || fitted.weight[x] < kLeastFitWeight) continue;
        auto& texel = out[static_cast<std::size_t>(y * kSlotSize + b * kLanes) + x];
        texel = {.irradiance = {fitted.value[0][x], fitted.value[1][x], fitted.value[2][x]},
                 .variance = fitted.noise[x],
                 .known = true};
        if (texel.variance > 0) texel.texels = std::max(1.0f, variance_[first + x] / texel.variance);
        texel.smear = smear_of(first + x, texel, fitted.weight[x]);
        texel.variance *= statistics_.evenness();
      }
    }
}

// Both means hold the texels around this one, the filtered with its largest share of a sample, 1 / weight, in each: the
// covariance. Variances are those of the filter, but for the spread of a sample.
float IrradianceFilter::smear_of(std::size_t at, const FilteredTexel& texel, float weight) const {
  const float spread = statistics_.spread()[at];
  if (!(spread > 0)) return 0;
  const auto& c = texel.irradiance;
  const float difference = 0.2126f * c[0] + 0.7152f * c[1] + 0.0722f * c[2] - statistics_.mean()[at];
  const float narrow = statistics_.variance()[at];
  const float covariance = std::min(spread / weight, std::sqrt(narrow * texel.variance));
  const float noise = texel.variance + narrow - 2 * covariance;
  return difference * difference - noise * statistics_.evenness() * (statistics_.inside()[at] / spread);
}

void IrradianceFilter::run(const FilterWindow& w, float target, std::vector<FilteredTexel>& out) {
  out.assign(kSlotTexels, FilteredTexel{});
  statistics_.run(w, target);
  if (statistics_.widest_class() == 0) return;
  with_slope_ = !w.first_pass();
  prepare(w);
  find_lit(w);
  filter_rows(w);
  filter_columns(w, out);
}

}  // namespace darm::renderer
