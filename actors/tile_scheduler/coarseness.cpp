#include "actors/tile_scheduler/coarseness.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace darm::tile_scheduler {
namespace {

constexpr std::array<float, 10> kError{0.0f, 0.016f, 0.025f, 0.033f, 0.045f, 0.047f, 0.05f, 0.055f, 0.06f, 0.065f};

}  // namespace

float error_of_coarser(float octaves) {
  if (!(octaves > 0)) return 0.0f;
  const float last = static_cast<float>(kError.size() - 1);
  const float at = std::min(octaves, last);
  const auto below = static_cast<std::size_t>(std::min(at, last - 1));
  return kError[below] + (kError[below + 1] - kError[below]) * (at - static_cast<float>(below));
}

float octaves_magnified(float pixel_texels) {
  return pixel_texels > 0 && pixel_texels < 1 ? -std::log2(pixel_texels) : 0.0f;
}

}  // namespace darm::tile_scheduler
