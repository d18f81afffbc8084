#include "actors/renderer/lost_light.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "actors/types/tile_id.hpp"

namespace darm::renderer {
namespace {

// Variance of a sum of rare samples over the squares of those that were found: the rarest were not.
constexpr double kTail = 3;

// Of the tile before, this and the next for the texel at `slot` (0..31) along an axis: quadratic B-spline, its knots at
// the borders of tiles, where two tiles that meet say the same.
std::array<double, 3> weights_at(int slot) {
  const double t = std::clamp((slot - 0.5) / kTileSize, 0.0, 1.0);
  return {0.5 * (1 - t) * (1 - t), 0.5 + t * (1 - t), 0.5 * t * t};
}

}  // namespace

float share_to_trust(double taken, double squares, double left) {
  if (!(taken > 0)) return 1;
  const double sure = std::max(1 - squares / (taken * taken), 0.0);
  return static_cast<float>(std::min(1.0, sure + left / taken));
}

void LostLight::Sums::add(const Sums& other, double weight) {
  texels += other.texels * weight;
  left += other.left * weight;
  lost += other.lost * weight;
  squares += other.squares * weight * weight;  // of a weighted sum
  for (std::size_t c = 0; c < 3; ++c) irradiance[c] += other.irradiance[c] * weight;
}

LostLight::Patch* LostLight::find(std::uint32_t patch) {
  const auto found = std::ranges::find(patches_, patch, &Patch::patch);
  return found != patches_.end() ? &*found : nullptr;
}

void LostLight::take(int tile, std::uint32_t patch, const glm::vec3& irradiance, float grey) {
  Patch* const known = find(patch);
  Patch& of = known != nullptr ? *known : patches_.emplace_back(Patch{.patch = patch});
  Sums& sums = of.tiles[static_cast<std::size_t>(tile)];
  sums.left -= double{grey};
  sums.lost += double{grey};
  sums.squares += double{grey} * double{grey};
  for (std::size_t c = 0; c < 3; ++c) sums.irradiance[c] += double{irradiance[static_cast<int>(c)]};
}

void LostLight::measure(const LightSquare& nine) {
  if (empty()) return;
  Patch* of = &patches_.front();
  for (int y = 0; y < nine.size; ++y)
    for (int x = 0; x < nine.size; ++x) {
      const auto at = static_cast<std::size_t>(y * nine.size + x);
      if (nine.count[at] <= 0) continue;
      if (of == nullptr || of->patch != nine.patch[at]) of = find(nine.patch[at]);
      if (of == nullptr) continue;
      Sums& sums = of->tiles[static_cast<std::size_t>(y / kTileSize * 3 + x / kTileSize)];
      ++sums.texels;
      sums.left += double{nine.grey[at]};
    }
}

LostLight::Share LostLight::at(std::uint32_t patch, int x, int y) {
  Patch* const of = find(patch);
  if (of == nullptr) return {};
  if (of->row != y) {
    const auto weights = weights_at(y);
    of->columns = {};
    for (std::size_t tile = 0; tile < 9; ++tile) of->columns[tile % 3].add(of->tiles[tile], weights[tile / 3]);
    of->row = y;
  }
  const auto weights = weights_at(x);
  Sums sums;
  for (std::size_t column = 0; column < 3; ++column) sums.add(of->columns[column], weights[column]);
  if (!(sums.lost > 0) || !(sums.texels > 0)) return {};
  const double each = 1 / sums.texels;
  const float trusted = share_to_trust(sums.lost, sums.squares, std::max(sums.left, 0.0));
  const double missing = 1 - double{trusted};
  const double square = missing * missing + kTail * sums.squares / (sums.lost * sums.lost);
  return {glm::vec3(sums.irradiance[0] * each, sums.irradiance[1] * each, sums.irradiance[2] * each),
          static_cast<float>(sums.lost * each), trusted, static_cast<float>(sums.lost * each * std::sqrt(square))};
}

}  // namespace darm::renderer
