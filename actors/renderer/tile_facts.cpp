#include "actors/renderer/tile_facts.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "actors/renderer/tile_fill.hpp"

namespace darm::renderer {

bool TileFacts::learn_albedo(const TileSurface& surface, const TexelMask& wanted, int wanted_points) {
  const int goal = std::min(wanted_points, 255);
  auto& points = albedo_means.points;
  bool learned = false;
  for (int texel = 0; texel < kTileTexels; ++texel) {
    const auto at = static_cast<std::size_t>(texel);
    if (!wanted.test(texel) || points[at] >= goal) continue;
    glm::vec3 sum = albedo(texel) * static_cast<float>(points[at]);
    glm::vec3 shine = emission(texel) * static_cast<float>(points[at]);
    for (int i = points[at]; i < goal; ++i) {
      if (const auto a = surface.albedo(texel, static_cast<std::uint32_t>(i))) sum += *a;
      if (!emission_means.empty()) shine += surface.emission(texel, static_cast<std::uint32_t>(i));
    }
    if (!emission_means.empty()) emission_means[at] = shine / static_cast<float>(goal);
    const glm::vec3 mean = sum / static_cast<float>(goal);
    for (int c = 0; c < 3; ++c) {
      const float a = mean[c] > 0.0f ? std::min(mean[c], 1.0f) : 0.0f;  // NaN becomes 0: not filtered
      albedo_means.bits[at][static_cast<std::size_t>(c)] = static_cast<std::uint16_t>(std::lround(a * 65535.0f));
    }
    points[at] = static_cast<std::uint8_t>(goal);
    learned = true;
  }
  return learned;
}

std::shared_ptr<const CoverageTile> cover_tile(TileId id, const LevelTiles& level, const TileSurfaces& surfaces,
                                               int points) {
  const auto own = surfaces.tile(id);
  if (!own || !own->translucent()) return nullptr;
  std::array<std::shared_ptr<const TileSurface>, 9> around;
  for (int d = 0; d < 9; ++d)
    if (const auto other = neighbour_of(id, level, d % 3 - 1, d / 3 - 1))
      around[static_cast<std::size_t>(d)] = d == 4 ? own : surfaces.tile(*other);

  SlotFill<1> fill;
  bool opaque = true;
  for (int y = 0; y < kSlotSize; ++y)
    for (int x = 0; x < kSlotSize; ++x) {
      const int column = x == 0 ? 0 : x == kSlotSize - 1 ? 2 : 1;
      const int row = y == 0 ? 0 : y == kSlotSize - 1 ? 2 : 1;
      const auto& surface = around[static_cast<std::size_t>(row * 3 + column)];
      if (!surface) continue;
      const int texel = (y + kTileSize - 1) % kTileSize * kTileSize + (x + kTileSize - 1) % kTileSize;
      const int at = y * kSlotSize + x;
      fill.patch[static_cast<std::size_t>(at)] = surface->patch(texel);
      float sum = 0;
      int found = 0;
      for (int i = 0; i < points && surface->patch(texel) != kNobody; ++i)
        if (const auto a = surface->alpha(texel, static_cast<std::uint32_t>(i))) {
          sum += *a;
          ++found;
        }
      if (found == 0) continue;
      fill.set(at, {sum / static_cast<float>(found)});
      opaque = opaque && sum >= static_cast<float>(found);
    }
  if (opaque) return nullptr;
  fill.run();
  auto coverage = std::make_shared<CoverageTile>();
  for (std::size_t i = 0; i < coverage->size(); ++i) {
    const float a = fill.value[i][0];
    (*coverage)[i] = static_cast<std::uint8_t>(std::lround((a > 0 ? std::min(a, 1.0f) : 0.0f) * 255.0f));
  }
  return coverage;
}

void TileFacts::learn_coverage(TileId id, const LevelTiles& level, const TileSurfaces& surfaces) {
  if (coverage_learned) return;
  coverage = cover_tile(id, level, surfaces);
  coverage_learned = true;
}

std::shared_ptr<TileFacts> TileFactsCache::get(TileId id, const TileSurfaces& surfaces,
                                               const atlas::RadianceStore& store) {
  {
    const std::scoped_lock lock(mutex_);
    if (const auto it = entries_.find(id); it != entries_.end()) {
      ages_.splice(ages_.end(), ages_, it->second.age);
      return it->second.facts;
    }
  }
  const auto surface = surfaces.tile(id);
  if (!surface) return nullptr;
  auto facts = std::make_shared<TileFacts>();
  for (int t = 0; t < kTileTexels; ++t) facts->patch[static_cast<std::size_t>(t)] = surface->patch(t);
  facts->walls = surface->walls();
  if (surface->emits())
    facts->emission_means.assign(kTileTexels, glm::vec3(0.0f));  // not stored: learned together with albedo
  else if (const auto stored = store.read(id))
    facts->albedo_means = stored->albedo();

  const std::scoped_lock lock(mutex_);
  if (const auto it = entries_.find(id); it != entries_.end()) return it->second.facts;
  while (entries_.size() >= max_tiles_) {
    entries_.erase(ages_.front());
    ages_.pop_front();
  }
  ages_.push_back(id);
  entries_.emplace(id, Entry{facts, std::prev(ages_.end())});
  return facts;
}

std::shared_ptr<const TileFacts> TileFactsCache::find(TileId id) const {
  const std::scoped_lock lock(mutex_);
  const auto it = entries_.find(id);
  if (it == entries_.end()) return nullptr;
  ages_.splice(ages_.end(), ages_, it->second.age);
  return it->second.facts;
}

}  // namespace darm::renderer
