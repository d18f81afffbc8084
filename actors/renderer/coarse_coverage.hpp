// Where the coarse level is cut out or see-through: what CoarseTex, three channels of light, cannot say.
#pragma once

#include <cstdint>
#include <vector>

#include "actors/renderer/tile_surface.hpp"
#include "actors/scene/scene.hpp"

namespace darm::renderer {

/// Mean alpha of each texel of the coarse level, 0..255, row-major over its `tiles` of 30x30 texels; empty where all of
/// it is opaque. Tiles that nobody sees have no slot, and so no coverage of their own: a cut-out's empty part is among
/// them, since the rays that ask what is seen go through it, and a client would paint it from CoarseTex. Depends on the
/// scene alone. Uses `threads` threads (at least 1), which have ended when it returns.
[[nodiscard]] std::vector<std::uint8_t> coarse_coverage(const scene::Scene& scene, int level, const LevelTiles& tiles,
                                                        const TileSurfaces& surfaces, unsigned threads);

}  // namespace darm::renderer
