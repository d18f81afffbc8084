#include "actors/tile_scheduler/view_tone.hpp"

#include <algorithm>
#include <cmath>

#include "actors/scene/view_materials.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr std::size_t kMostTaps = 4096;
constexpr float kLeastDiffuse = 0.02f;  // what reflects less says nothing of the light that falls on it
constexpr double kUsualStep = 0.045;    // RMS difference of neighbours in the plainest of the nine evaluation views

double linear(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }

double error_at(const CoarseLuma& coarse, std::uint32_t x, std::uint32_t y) {
  const std::size_t tile = std::size_t{y / kTileSize} * (coarse.width / kTileSize) + x / kTileSize;
  return double{tile < coarse.errors.size() ? coarse.errors[tile] : ViewTone{}.coarse_light};
}

// Sums over taps.
struct Sums {
  double looked = 0, linear = 0, squares = 0, headroom = 0, steps = 0, errors = 0;

  void look(const CoarseLuma& coarse, std::uint32_t x, std::uint32_t y) {
    const auto at = [&](std::uint32_t i, std::uint32_t j) {
      return static_cast<double>(coarse.luma[std::size_t{j} * coarse.width + i]) / 255.0;
    };
    const double here = at(x, y);
    const double right = at(std::min(x + 1, coarse.width - 1), y) - here;
    const double down = at(x, std::min(y + 1, coarse.height - 1)) - here;
    ++looked;
    linear += tile_scheduler::linear(here);
    squares += here * here;
    headroom += (1 - here) * (1 - here);
    steps += 0.5 * (right * right + down * down);
    const double error = error_at(coarse, x, y);
    errors += error * error;
  }
};

}  // namespace

ViewTone tone_of(const VisibleSet& view, const CoarseLuma* coarse) {
  const auto taps = view.taps();
  if (coarse == nullptr || coarse->luma.empty() || taps.empty()) return {};
  Sums sums;
  const std::size_t stride = (taps.size() + kMostTaps - 1) / kMostTaps;
  for (std::size_t i = 0; i < taps.size(); i += stride)
    sums.look(*coarse, std::min<std::uint32_t>(taps[i].coarse[0] / 8u, coarse->width - 1),
              std::min<std::uint32_t>(taps[i].coarse[1] / 8u, coarse->height - 1));
  ViewTone tone;
  if (const float diffuse = view.mean_diffuse(); diffuse > kLeastDiffuse)
    tone.surroundings = std::min(1.0f, static_cast<float>(sums.linear / sums.looked) / diffuse);
  tone.brightness = static_cast<float>(std::sqrt(sums.squares / sums.looked));
  tone.headroom = static_cast<float>(std::sqrt(sums.headroom / sums.looked));
  tone.coarse_light = static_cast<float>(std::sqrt(sums.errors / sums.looked));
  tone.variety = static_cast<float>(std::sqrt(std::min(1.0, std::sqrt(sums.steps / sums.looked) / kUsualStep)));
  return tone;
}

float shown_of_omitted(const ViewTone& tone) {
  // The display curve is nearly a power: a factor in light is one in what is shown, and in its differences.
  return std::pow(tone.surroundings / scene::kGreySurroundings, 1.0f / 2.2f);
}

float omitted_error(const VisibleSet& view, const ViewTone& tone) {
  return std::min(tone.headroom, view.omitted_error() * shown_of_omitted(tone));
}

}  // namespace darm::tile_scheduler
