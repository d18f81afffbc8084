// Texels of the coarse level with a wall in them: their light is a mean of two rooms, and no path may end in it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "actors/renderer/stored_light.hpp"
#include "actors/renderer/tile_surface.hpp"
#include "actors/types/texel_mask.hpp"

namespace darm::renderer {

/// Looks at each texel once, when it first has light. Different tiles may be asked for by different threads.
class DividedTexels {
 public:
  DividedTexels(int level, std::uint32_t tiles) : level_(level), looks_(tiles) {}

  /// Makes those of the tile's kTileTexels texels unknown that are divided (TileSurface::divided).
  void forget(std::uint32_t tile_index, std::span<StoredTexel> texels, const TileSurfaces& surfaces);

 private:
  struct Looks {
    TexelMask done, divided;
  };
  int level_;
  std::vector<std::unique_ptr<Looks>> looks_;  // of tiles that had light
};

}  // namespace darm::renderer
