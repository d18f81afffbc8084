#include "actors/renderer/stored_light.hpp"

#include <algorithm>
#include <cmath>

namespace darm::renderer {

using atlas::Layer;

namespace {

constexpr float kLeastTexels = 2.0f;

}  // namespace

std::array<StoredTexel, kTileTexels> stored_texels(const atlas::TileView& tile,
                                                   std::span<const FilteredTexel> filtered) {
  std::array<StoredTexel, kTileTexels> out;
  for (int t = 0; t < kTileTexels; ++t) {
    auto& texel = out[static_cast<std::size_t>(t)];
    texel = StoredTexel{};
    if (tile.count(Layer::kSharp, t) <= 0) continue;
    const auto slot = static_cast<std::size_t>((t / kTileSize + 1) * kSlotSize + t % kTileSize + 1);
    const bool smooth = slot < filtered.size() && filtered[slot].known;
    if (!smooth && tile.count(Layer::kSoft, t) <= 0) continue;
    glm::vec3 soft = tile.mean(Layer::kSoft, t);
    if (smooth) soft = {filtered[slot].irradiance[0], filtered[slot].irradiance[1], filtered[slot].irradiance[2]};
    texel = {tile.mean(Layer::kSharp, t), soft, true};
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
    const float least = std::min({from.sharp.x, from.sharp.y, from.sharp.z, from.soft.x, from.soft.y, from.soft.z});
    const bool sound = from.known && least >= 0 && std::isfinite(sum.x + sum.y + sum.z);
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

}  // namespace darm::renderer
