#include "actors/renderer/stored_light.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "actors/renderer/sampling.hpp"

namespace darm::renderer {

using atlas::Layer;

namespace {

constexpr float kLeastTexels = 2.0f;

// Weighted variance of both layers' luminances, of their differences to one of them: that of nearly equal ones is
// exact.
struct Spread {
  float weight = 0;
  glm::vec2 sum{0.0f}, squares{0.0f};

  void add(const glm::vec2& v, float w) {
    weight += w;
    sum += w * v;
    squares += w * v * v;
  }
  [[nodiscard]] glm::vec2 variance() const {
    if (!(weight > 0)) return glm::vec2(0.0f);
    return glm::max(squares / weight - sum * sum / (weight * weight), glm::vec2(0.0f));
  }
};

// Of the nine that the weights of sixteen texels add up to.
constexpr float kMostAround = 6.0f;

// Of the four texels along an axis around a place `part` of the way from the second to the third: what a look-up there
// reads, and what three look-ups do that are a texel apart.
float near_weight(int i, float part) { return i == 1 ? 1 - part : i == 2 ? part : 0.0f; }
float around_weight(int i, float part) { return i == 0 ? 1 - part : i == 3 ? part : 1.0f; }

}  // namespace

std::array<StoredTexel, kTileTexels> stored_texels(const atlas::TileView& tile,
                                                   std::span<const FilteredTexel> filtered) {
  std::array<StoredTexel, kTileTexels> out;
  for (int t = 0; t < kTileTexels; ++t) {
    auto& texel = out[static_cast<std::size_t>(t)];
    texel = StoredTexel{};
    if (tile.count(Layer::kSharp, t) <= 0 || tile.lightless(t)) continue;
    const auto slot = static_cast<std::size_t>((t / kTileSize + 1) * kSlotSize + t % kTileSize + 1);
    const bool smooth = slot < filtered.size() && filtered[slot].known;
    if (!smooth && tile.count(Layer::kSoft, t) <= 0) continue;
    glm::vec3 soft = tile.mean(Layer::kSoft, t);
    const float grey = luminance(soft);
    float noise = tile.variance_of_mean(Layer::kSoft, t, grey * grey);
    if (smooth) {
      const FilteredTexel& from = filtered[slot];
      for (std::size_t c = 0; c < 3; ++c) soft[static_cast<int>(c)] = from.irradiance[c] + from.withheld[c];
      noise = from.variance + from.lost_error * from.lost_error;
    }
    texel = {tile.mean(Layer::kSharp, t), soft, true, noise};
  }
  return out;
}

StoredLight::StoredLight(std::shared_ptr<const atlas::Layout> layout) : layout_(std::move(layout)) {
  const auto& level = layout_->levels.back();
  least_distance_ = kLeastTexels / level.density;
  texels_.assign(std::size_t{level.width} * level.height, StoredTexel{});
}

void StoredLight::put(std::uint32_t tile_index, std::span<const StoredTexel> texels) {
  const auto& level = layout_->levels.back();
  if (tile_index >= level.tiles_x * level.tiles_y || texels.size() != kTileTexels) return;
  const std::size_t x = tile_index % level.tiles_x * kTileSize;
  const std::size_t y = tile_index / level.tiles_x * kTileSize;
  for (std::size_t t = 0; t < kTileTexels; ++t) {
    const auto& from = texels[t];
    const glm::vec3 sum = from.sharp + from.soft;
    const float least =
        std::min({from.sharp.x, from.sharp.y, from.sharp.z, from.soft.x, from.soft.y, from.soft.z, from.soft_variance});
    const bool sound = from.known && least >= 0 && std::isfinite(sum.x + sum.y + sum.z + from.soft_variance);
    texels_[(y + t / kTileSize) * level.width + x + t % kTileSize] = sound ? from : StoredTexel{};
  }
}

const StoredTexel* StoredLight::find(const trace::Surface& s, const glm::vec2& xi) const {
  const PatchId patch = layout_->patch_of(s.instance, s.triangle, s.front);
  if (patch == kNoPatch) return nullptr;
  const auto& level = layout_->levels.back();
  const glm::vec2 at =
      layout_->texel_at(patch, layout_->coarse_level(), layout_->patch_uv(s.instance, s.triangle, s.u, s.v)) - 0.5f +
      xi;
  if (!(at.x >= 0 && at.y >= 0)) return nullptr;
  const auto x = static_cast<std::size_t>(at.x);
  const auto y = static_cast<std::size_t>(at.y);
  if (x >= level.width || y >= level.height) return nullptr;
  const StoredTexel& texel = texels_[y * level.width + x];
  return texel.known ? &texel : nullptr;
}

std::optional<LightGuess> StoredLight::guess(PatchId patch, int level, const glm::vec2& at) const {
  const auto& from = layout_->levels[static_cast<std::size_t>(level)];
  const auto& to = layout_->levels.back();
  const auto& place = from.placements[index_of(patch)];
  const auto& coarse = to.placements[index_of(patch)];
  // A patch of one texel (scale 0) is one at every coarser level.
  const float ratio = place.scale > 0 ? coarse.scale * to.density / (place.scale * from.density) : 0.0f;
  const glm::vec2 corner =
      (at - 0.5f - glm::vec2(place.x, place.y)) * ratio + glm::vec2(coarse.x, coarse.y);  // texel centres at integers
  LightGuess out;
  out.lone = !(ratio > 0);
  const glm::vec2 floor = glm::floor(corner);
  const glm::vec2 part = corner - floor;
  Spread near, around;
  glm::vec2 pivot(0.0f);
  for (int j = 0; j < 4; ++j) {
    const float y = floor.y + static_cast<float>(j - 1);
    for (int i = 0; i < 4; ++i) {
      const float x = floor.x + static_cast<float>(i - 1);
      const float w = near_weight(i, part.x) * near_weight(j, part.y);
      if (out.lone && !(w > 0)) continue;  // the others are other patches'
      if (!(x >= 0 && y >= 0) || x >= static_cast<float>(to.width) || y >= static_cast<float>(to.height)) continue;
      const StoredTexel& texel = texels_[static_cast<std::size_t>(y) * to.width + static_cast<std::size_t>(x)];
      if (!texel.known) continue;
      const glm::vec2 grey(luminance(texel.sharp), luminance(texel.soft));
      if (around.weight == 0) pivot = grey;
      around.add(grey - pivot, around_weight(i, part.x) * around_weight(j, part.y));
      if (!(w > 0)) continue;
      near.add(grey - pivot, w);
      out.sharp += w * texel.sharp;
      out.soft += w * texel.soft;
      out.soft_noise += w * texel.soft_variance;
    }
  }
  if (!(near.weight > 1e-3f)) return std::nullopt;
  out.sharp /= near.weight;
  out.soft /= near.weight;
  out.soft_noise /= near.weight;
  const glm::vec2 spread = near.variance();
  const glm::vec2 wide = around.variance();
  out.sharp_spread = spread.x;
  out.soft_spread = spread.y;
  out.sharp_around = wide.x;
  out.soft_around = wide.y;
  out.surrounded = around.weight > kMostAround;
  return out;
}

}  // namespace darm::renderer
