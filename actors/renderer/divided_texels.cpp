#include "actors/renderer/divided_texels.hpp"

#include "actors/types/tile_id.hpp"

namespace darm::renderer {

void DividedTexels::forget(std::uint32_t tile_index, std::span<StoredTexel> texels, const TileSurfaces& surfaces) {
  if (tile_index >= looks_.size() || texels.size() != kTileTexels) return;
  auto& looks = looks_[tile_index];
  if (!looks) looks = std::make_unique<Looks>();
  std::shared_ptr<const TileSurface> surface;
  for (int t = 0; t < kTileTexels; ++t) {
    auto& texel = texels[static_cast<std::size_t>(t)];
    if (!texel.known) continue;
    if (!looks->done.test(t)) {
      if (!surface) surface = surfaces.tile(TileId(level_, tile_index));
      if (!surface) return;
      looks->done.set(t % kTileSize, t / kTileSize);
      if (surface->divided(t)) looks->divided.set(t % kTileSize, t / kTileSize);
    }
    if (looks->divided.test(t)) texel.known = false;
  }
}

}  // namespace darm::renderer
