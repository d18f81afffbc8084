// What view shading asks of the 32x32 texels of a slot. The scene's own answer is in view_surface_scene.hpp.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>

#include "actors/renderer/light_transport.hpp"
#include "actors/types/tile_id.hpp"
#include "actors/types/tile_image.hpp"

namespace darm::renderer {

/// One slot: the tile's payload and, around it, the nearest texels of its neighbours. `at` is y * 32 + x. For one
/// thread.
class ViewSurface {
 public:
  virtual ~ViewSurface() = default;
  /// Patch that owns the texel, or kNobody.
  [[nodiscard]] virtual std::uint32_t patch(int at) = 0;
  /// Sample number `sample` of sequence `sequence` of the light towards `eye`: a random point of the texel's box, a
  /// random path from it. nullopt: nothing of the patch under it.
  [[nodiscard]] virtual std::optional<ViewDependentLight> light(int at, const glm::vec3& eye, std::uint32_t sequence,
                                                                std::uint32_t sample) = 0;
  /// What clear surfaces of the tile pass; null if nothing in it is clear.
  [[nodiscard]] virtual std::shared_ptr<const ThroughTile> through() = 0;
};

/// The surfaces of all tiles. Thread-safe.
class ViewSurfaces {
 public:
  virtual ~ViewSurfaces() = default;
  /// Null outside the level. Paths behind its reflections end in `stored`, if there is any.
  [[nodiscard]] virtual std::unique_ptr<ViewSurface> tile(TileId id,
                                                          std::shared_ptr<const StoredLight> stored) const = 0;
};

}  // namespace darm::renderer
