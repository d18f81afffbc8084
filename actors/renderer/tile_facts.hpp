// What display needs to know of a tile's surface and does not change with light: patches, albedo, coverage.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "actors/atlas/radiance_store.hpp"
#include "actors/renderer/tile_surface.hpp"
#include "actors/types/texel_mask.hpp"
#include "actors/types/tile_image.hpp"

namespace darm::renderer {

/// About 10 KB a tile. Albedo and emission are averaged over a few points of each texel, only where somebody has
/// shaded.
struct TileFacts {
  std::array<std::uint32_t, kTileTexels> patch{};
  TileWalls walls;
  atlas::TileAlbedo albedo_means;
  std::vector<glm::vec3> emission_means;         ///< per texel, nits, of the same points; empty: nothing emits
  std::shared_ptr<const CoverageTile> coverage;  ///< null: opaque, or not learned
  bool coverage_learned = false;

  [[nodiscard]] bool knows_albedo(int texel) const { return albedo_means.points[static_cast<std::size_t>(texel)] > 0; }
  [[nodiscard]] glm::vec3 albedo(int texel) const {
    const auto& a = albedo_means.bits[static_cast<std::size_t>(texel)];
    return glm::vec3(a[0], a[1], a[2]) * (1.0f / 65535.0f);
  }
  [[nodiscard]] glm::vec3 emission(int texel) const {
    return emission_means.empty() ? glm::vec3(0.0f) : emission_means[static_cast<std::size_t>(texel)];
  }
  /// Fills `coverage` in once.
  void learn_coverage(TileId id, const LevelTiles& level, const TileSurfaces& surfaces);
  /// Brings albedo and emission of each texel of `wanted` to a mean of `wanted_points` points: few at first, so that
  /// the first picture comes soon, more when light is exact enough to show the difference. True if something was
  /// learned.
  bool learn_albedo(const TileSurface& surface, const TexelMask& wanted, int wanted_points = 4);
};

/// Mean alpha of the slot's 32x32 texels, border from the neighbour tiles; null if all of it is opaque.
[[nodiscard]] std::shared_ptr<const CoverageTile> cover_tile(TileId id, const LevelTiles& level,
                                                             const TileSurfaces& surfaces, int points = 8);

/// Bounded cache, least recently made or found out first. Thread-safe; the facts of one tile are changed by one thread
/// at a time, and not while they are read (the renderer's phases).
class TileFactsCache {
 public:
  explicit TileFactsCache(std::size_t max_tiles = 16384) : max_tiles_(max_tiles < 16 ? 16 : max_tiles) {}

  /// The tile's facts, made (patches; albedo as far as `store` knows it) if they are not there. Null
  /// outside the level. Reads the tile's block: nobody may write it then.
  std::shared_ptr<TileFacts> get(TileId id, const TileSurfaces& surfaces, const atlas::RadianceStore& store);
  [[nodiscard]] std::shared_ptr<const TileFacts> find(TileId id) const;

 private:
  struct Entry {
    std::shared_ptr<TileFacts> facts;
    std::list<TileId>::iterator age;
  };
  mutable std::mutex mutex_;
  std::size_t max_tiles_;
  mutable std::list<TileId> ages_;  // oldest first
  mutable std::unordered_map<TileId, Entry> entries_;
};

}  // namespace darm::renderer
