#include "actors/tile_scheduler/private_set.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "actors/tile_scheduler/texel_taps.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr float kMostReach = 6.0f;  // texels

// Marks the texels that a bilinear look-up at `at` (slot coordinates) reads, and those within `reach` of it.
void mark(SlotMask& mask, glm::vec2 at, glm::vec2 reach) {
  const auto low = [](float v) { return std::clamp(static_cast<int>(std::floor(v - 0.5f)), 0, kSlotSize - 1); };
  const auto high = [](float v) { return std::clamp(static_cast<int>(std::ceil(v - 0.5f)), 0, kSlotSize - 1); };
  const int x0 = low(at.x - reach.x);
  const int x1 = high(at.x + reach.x);
  for (int y = low(at.y - reach.y); y <= high(at.y + reach.y); ++y) mask.set_row(y, x0, x1);
}

}  // namespace

SlotMask* PrivateSet::mask_of(TileId tile) {
  if (tiles_.size() >= kMaxTiles && tiles_.find(tile) == TileIndex::kAbsent) {
    ++left_out_;
    return nullptr;
  }
  const auto number = tiles_.insert(tile);
  if (number == masks_.size()) masks_.emplace_back();
  return &masks_[number];
}

void PrivateSet::add(const atlas::Layout& layout, const SurfaceSample& sample, const scene::ViewMaterial& material,
                     float early_pixels) {
  if (material.weight <= 0) return;
  const int length = std::min(kChainLength, layout.coarse_level() - sample.level + 1);
  const int first = std::min(int{material.coarser}, length - 1);
  Chain chain;
  for (int i = 0; i < length; ++i) {
    const int number = sample.level + i;
    const auto& level = layout.levels[static_cast<std::size_t>(number)];
    const glm::vec2 texel = layout.texel_at(sample.patch, number, sample.uv);
    const TileId tile = tile_holding(layout, number, texel);
    if (i >= first) chain.tiles[static_cast<std::size_t>(i - first)] = tile;
    // Finer levels than the chain's are not asked for, but read where another patch of the tile has brought it.
    auto* mask = mask_of(tile);
    if (mask == nullptr) continue;
    const float scale = level.placements[index_of(sample.patch)].scale * level.density;
    glm::vec2 reach = (glm::abs(sample.uv_dx) + glm::abs(sample.uv_dy)) * (early_pixels * scale);
    if (!std::isfinite(reach.x) || !std::isfinite(reach.y)) reach = glm::vec2(0.0f);
    const glm::vec2 corner = glm::vec2(tile.index() % level.tiles_x, tile.index() / level.tiles_x) * float{kTileSize};
    mark(*mask, texel - corner + 1.0f, glm::min(reach, glm::vec2(kMostReach)));
  }
  count(chain, material.weight, material.squared_omitted(sample.cosine), 1.0f);
}

void PrivateSet::count(const Chain& chain, float worth, float square, float samples) {
  if (chains_.size() >= kMaxChains && chains_.find(chain) == ChainIndex::kAbsent) {
    ++left_out_;
    return;
  }
  const auto number = chains_.insert(chain);
  if (number == worths_.size()) {
    worths_.push_back(0.0f);
    squares_.push_back(0.0f);
    counts_.push_back(0.0f);
  }
  worths_[number] += worth;
  squares_[number] += square;
  counts_[number] += samples;
}

void PrivateSet::merge(const PrivateSet& other) {
  for (std::size_t i = 0; i < other.chains().size(); ++i)
    count(other.chains()[i], other.worths_[i], other.squares_[i], other.counts_[i]);
  for (std::size_t i = 0; i < other.tiles_.size(); ++i)
    if (auto* mine = mask_of(other.tiles_.keys()[i])) *mine |= other.masks_[i];
  samples_ += other.samples_;
  left_out_ += other.left_out_;
}

const SlotMask* PrivateSet::find(TileId tile) const {
  const auto number = tiles_.find(tile);
  return number == TileIndex::kAbsent ? nullptr : &masks_[number];
}

}  // namespace darm::tile_scheduler
