// Texel -> surface, one tile at a time, on demand: at q=64 a scene may have 250 M texels, so nothing is made eagerly.
#pragma once

#include <array>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <unordered_map>
#include <vector>

#include "actors/atlas/footprint.hpp"
#include "actors/atlas/layout.hpp"
#include "actors/atlas/tile_texels.hpp"
#include "actors/scene/scene.hpp"
#include "actors/types/tile_id.hpp"

namespace darm::atlas {

/// Which patches touch which tiles of one level, by the box of their own texels.
class LevelIndex {
 public:
  LevelIndex(const Layout& layout, int level);
  [[nodiscard]] std::span<const std::uint32_t> patches_in(std::uint32_t tile_index) const {
    return {patches_.data() + first_[tile_index], first_[tile_index + 1] - first_[tile_index]};
  }

 private:
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> patches_;
};

/// Rasterises tiles of a layout and keeps the last used ones. All members may be called from any thread.
class TexelMapper {
 public:
  /// `cache_bytes` bounds the tiles that are kept (the index of a level, a few bytes per tile, comes on top).
  TexelMapper(std::shared_ptr<const scene::Scene> scene, std::shared_ptr<const Layout> layout,
              std::size_t cache_bytes = std::size_t{256} << 20);
  ~TexelMapper();
  TexelMapper(const TexelMapper&) = delete;
  TexelMapper& operator=(const TexelMapper&) = delete;

  /// Never null. A tile outside its level is empty.
  [[nodiscard]] std::shared_ptr<const TileTexels> tile(TileId id) const;

  [[nodiscard]] const Layout& layout() const { return *layout_; }
  [[nodiscard]] std::size_t cached_bytes() const;
  /// Instance, local patch and side of a patch.
  struct PatchOwner {
    std::uint32_t instance;
    std::uint32_t local;
    bool front;
  };
  [[nodiscard]] PatchOwner owner_of(PatchId patch) const;

 private:
  struct Kept {
    std::shared_ptr<const TileTexels> tile;
    std::list<TileId>::iterator age;
  };
  [[nodiscard]] const LevelIndex& index_of_level(int level) const;
  [[nodiscard]] std::shared_ptr<const TileTexels> make(TileId id) const;

  std::shared_ptr<const scene::Scene> scene_;
  std::shared_ptr<const Layout> layout_;
  std::size_t cache_bytes_;
  std::vector<PatchTriangles> triangles_;                       ///< per chart
  std::vector<std::pair<std::uint32_t, std::uint32_t>> bases_;  ///< (first patch, instance * 2 + back), ascending
  mutable std::array<std::once_flag, kMaxLevels> index_once_;
  mutable std::array<std::unique_ptr<LevelIndex>, kMaxLevels> index_;
  mutable std::mutex guard_;
  mutable std::unordered_map<TileId, Kept> kept_;
  mutable std::list<TileId> ages_;  ///< last used first
  mutable std::size_t bytes_ = 0;
};

}  // namespace darm::atlas
