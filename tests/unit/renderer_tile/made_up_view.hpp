// Slots made up for tests of view shading: light is a function of tile, texel, eye and sample number.
#pragma once

#include <functional>

#include "actors/renderer/view_surface.hpp"

namespace darm::renderer {

struct MadeUpView {
  std::function<ViewDependentLight(TileId, int at, const glm::vec3& eye, std::uint32_t sample)> light =
      [](TileId, int, const glm::vec3&, std::uint32_t) {
        ViewDependentLight l;
        l.radiance = glm::vec3(0.25f);
        l.ggx_alpha = 0.001f;
        l.distance = 1;
        return l;
      };
  std::function<std::uint32_t(TileId, int x, int y)> patch = [](TileId, int, int) { return 0u; };
  std::shared_ptr<const ThroughTile> through;
};

class MadeUpSlot : public ViewSurface {
 public:
  MadeUpSlot(TileId id, const MadeUpView& world) : id_(id), world_(world) {}
  [[nodiscard]] std::uint32_t patch(int at) override { return world_.patch(id_, at % kSlotSize, at / kSlotSize); }
  [[nodiscard]] std::optional<ViewDependentLight> light(int at, const glm::vec3& eye, std::uint32_t,
                                                        std::uint32_t sample) override {
    if (patch(at) == 0xffffffffu) return std::nullopt;
    return world_.light(id_, at, eye, sample);
  }
  [[nodiscard]] std::shared_ptr<const ThroughTile> through() override { return world_.through; }

 private:
  TileId id_;
  const MadeUpView& world_;
};

class MadeUpSlots : public ViewSurfaces {
 public:
  MadeUpView world;
  mutable std::shared_ptr<const StoredLight> stored;  ///< that the last tile was asked for with
  [[nodiscard]] std::unique_ptr<ViewSurface> tile(TileId id, std::shared_ptr<const StoredLight> light) const override {
    stored = std::move(light);
    return std::make_unique<MadeUpSlot>(id, world);
  }
};

inline SlotMask whole_slot() {
  SlotMask mask;
  for (int y = 0; y < kSlotSize; ++y) mask.set_row(y, 0, kSlotSize - 1);
  return mask;
}

}  // namespace darm::renderer
