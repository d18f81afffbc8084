// What shading and display ask of a tile's surface. The scene's own answer is in tile_surface_scene.hpp; tests give
// theirs.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "actors/renderer/renderer_messages.hpp"
#include "actors/renderer/tile_walls.hpp"
#include "actors/types/tile_id.hpp"

namespace darm::renderer {

class StoredLight;

inline constexpr std::uint32_t kNobody = 0xffffffffu;

/// The surface under the 900 payload texels of one tile. Immutable, thread-safe.
class TileSurface {
 public:
  virtual ~TileSurface() = default;
  /// Patch that owns the texel (gutter included), or kNobody.
  [[nodiscard]] virtual std::uint32_t patch(int texel) const = 0;
  /// Sample number `sample` of irradiance / pi, nits, one layer of it (atlas::Layer): a random point of the texel's
  /// box, a random path from it. Times albedo, plus emission, it is the light that leaves the texel whatever the eye.
  /// The same number gives the same sample. nullopt: nothing of the patch under it.
  [[nodiscard]] virtual std::optional<glm::vec3> sharp(int texel, std::uint32_t sample) const = 0;
  [[nodiscard]] virtual std::optional<glm::vec3> soft(int texel, std::uint32_t sample) const = 0;
  /// What reflected light is multiplied with at point `sample` of the texel, 0..1 a channel.
  [[nodiscard]] virtual std::optional<glm::vec3> albedo(int texel, std::uint32_t sample) const = 0;
  /// Own radiance at that point, nits.
  [[nodiscard]] virtual glm::vec3 emission(int texel, std::uint32_t sample) const = 0;
  /// True if some texel's material emits light of its own.
  [[nodiscard]] virtual bool emits() const = 0;
  /// Opacity at point `sample` of the texel, 0..1.
  [[nodiscard]] virtual std::optional<float> alpha(int texel, std::uint32_t sample) const = 0;
  /// True if some texel's material is alpha MASK or BLEND.
  [[nodiscard]] virtual bool translucent() const = 0;
  /// True if something stands between the texel's middle and its sides, so that its light is that of two places.
  [[nodiscard]] virtual bool divided(int texel) const {
    (void)texel;
    return false;
  }
  /// What stands between texels. A thousand rays at most.
  [[nodiscard]] virtual TileWalls walls() const { return {}; }
};

/// The surfaces of all tiles. Thread-safe.
class TileSurfaces {
 public:
  virtual ~TileSurfaces() = default;
  /// Null outside the level. The surface samples with the stored light of the moment it was asked for.
  [[nodiscard]] virtual std::shared_ptr<const TileSurface> tile(TileId id) const = 0;
  /// Texels of the coarse level that surfaces which emit shine on, where those are the scene's only light and shine on
  /// little; else none. Some milliseconds.
  [[nodiscard]] virtual std::vector<CoarseRequest> shone_on() const { return {}; }
  /// Gives `light`, which nobody else reads yet, its bright texels. Long work.
  virtual void find_bright(StoredLight& light) const { (void)light; }
  /// From now on paths end in `light` (null: in none). Not while another thread calls tile().
  virtual void use_stored_light(std::shared_ptr<const StoredLight> light) { (void)light; }
};

/// Tiles of each level, for stepping to a neighbour.
struct LevelTiles {
  std::uint32_t x = 0;
  std::uint32_t y = 0;
};

/// The tile (dx, dy) tiles away on the same level; nullopt outside it.
[[nodiscard]] inline std::optional<TileId> neighbour_of(TileId id, const LevelTiles& level, int dx, int dy) {
  if (level.x == 0) return std::nullopt;
  const auto x = static_cast<std::int64_t>(id.index() % level.x) + dx;
  const auto y = static_cast<std::int64_t>(id.index() / level.x) + dy;
  if (x < 0 || y < 0 || x >= level.x || y >= level.y) return std::nullopt;
  return TileId(id.level(), static_cast<std::uint32_t>(y * level.x + x));
}

}  // namespace darm::renderer
