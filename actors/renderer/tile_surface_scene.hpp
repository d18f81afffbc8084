// The scene's tile surfaces: atlas mapping and light transport behind the questions of tile_surface.hpp.
#pragma once

#include <memory>
#include <vector>

#include "actors/atlas/texel_map.hpp"
#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/tile_surface.hpp"

namespace darm::renderer {

/// Samples of a texel are numbered by (seed, tile, texel, sample): no state, the same on every machine and thread.
/// Where a material is alpha MASK, light and albedo are those of its covered part.
[[nodiscard]] std::shared_ptr<TileSurfaces> make_scene_surfaces(std::shared_ptr<const scene::Scene> scene,
                                                                std::shared_ptr<const atlas::TexelMapper> mapper,
                                                                std::shared_ptr<const LightTransport> transport,
                                                                std::uint64_t seed = 0);

[[nodiscard]] std::vector<LevelTiles> level_tiles_of(const atlas::Layout& layout);

}  // namespace darm::renderer
