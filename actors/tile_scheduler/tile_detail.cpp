#include "actors/tile_scheduler/tile_detail.hpp"

#include <algorithm>
#include <cmath>

namespace darm::tile_scheduler {

float detail_of(const TileImage& image) {
  int sum = 0;  // at most 225 blocks * 4 * 255^2, scaled by 4: fits
  for (int y = 1; y + 1 < kSlotSize; y += 2) {
    for (int x = 1; x + 1 < kSlotSize; x += 2) {
      const auto at = static_cast<std::size_t>(y * kSlotSize + x);
      const int a = image.y[at], b = image.y[at + 1];
      const int c = image.y[at + kSlotSize], d = image.y[at + kSlotSize + 1];
      const int total = a + b + c + d;
      sum += 4 * (a * a + b * b + c * c + d * d) - total * total;  // 4 * sum of squared differences to the mean
    }
  }
  return static_cast<float>(sum) / (4.0f * kTileTexels);
}

float detail_factor(float detail, float usual) {
  if (!(usual > 0) || !(detail >= 0)) return 1.0f;
  const float exponent = std::round(std::log2(std::max(detail / usual, 1e-6f)));
  return std::exp2(std::clamp(exponent, -4.0f, 3.0f));
}

}  // namespace darm::tile_scheduler
