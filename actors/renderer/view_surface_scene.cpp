#include "actors/renderer/view_surface_scene.hpp"

#include <algorithm>
#include <array>

#include "actors/renderer/display_curve.hpp"
#include "actors/renderer/sampler.hpp"
#include "actors/renderer/surface_world.hpp"
#include "actors/renderer/tile_surface.hpp"

namespace darm::renderer {
namespace {

constexpr int kThroughPoints = 4;
constexpr std::uint64_t kThroughSeed = 0xc1ea5;
constexpr std::uint64_t kViewSeed = 0x71e30000;

class SceneSlot : public ViewSurface {
 public:
  SceneSlot(TileId id, LevelTiles level, std::shared_ptr<const SurfaceWorld> world,
            std::shared_ptr<const StoredLight> stored)
      : id_(id), level_(level), world_(std::move(world)), stored_(std::move(stored)) {}

  [[nodiscard]] std::uint32_t patch(int at) override {
    const auto place = place_of(at);
    return place.texels == nullptr ? kNobody : index_of(place.texels->patch_at(place.x, place.y));
  }

  [[nodiscard]] std::optional<ViewDependentLight> light(int at, const glm::vec3& eye, std::uint32_t sequence,
                                                        std::uint32_t sample) override {
    Sampler sampler(world_->seed ^ kViewSeed ^ (std::uint64_t{sequence} << 32),
                    hash_pair(id_.packed, static_cast<std::uint32_t>(at)), sample);
    const auto point = covered_point(at, sampler);
    if (!point) return std::nullopt;
    return world_->transport->view_dependent(*point, eye, sampler, stored_.get());
  }

  [[nodiscard]] std::shared_ptr<const ThroughTile> through() override {
    const auto* own = texels(4);
    if (own == nullptr) return nullptr;
    const bool clear = std::any_of(own->fragments().begin(), own->fragments().end(), [this](const auto& f) {
      const auto& m = world_->material_of(f.instance);
      return m.transmission > 0 && m.thickness <= 0;
    });
    if (!clear) return nullptr;
    auto made = std::make_shared<ThroughTile>();
    for (int at = 0; at < kSlotTexels; ++at) {
      glm::vec3 sum(0.0f);
      int found = 0;
      for (std::uint32_t i = 0; i < kThroughPoints; ++i) {
        Sampler sampler(kThroughSeed, hash_pair(id_.packed, static_cast<std::uint32_t>(at)), i);
        if (const auto point = covered_point(at, sampler)) {
          sum += world_->transport->clear_tint(*point);
          ++found;
        }
      }
      for (int c = 0; c < 3; ++c)
        (*made)[static_cast<std::size_t>(at * 3 + c)] = srgb_code(found > 0 ? sum[c] / static_cast<float>(found) : 0);
    }
    return made;
  }

 private:
  struct Place {
    const atlas::TileTexels* texels;
    int x, y;
  };

  // Tile 0..8 around and with this one (4), mapped when first asked for.
  const atlas::TileTexels* texels(int which) {
    const auto at = static_cast<std::size_t>(which);
    if (!asked_[at]) {
      asked_[at] = true;
      if (const auto other = neighbour_of(id_, level_, which % 3 - 1, which / 3 - 1))
        around_[at] = world_->mapper->tile(*other);
    }
    return around_[at].get();
  }

  Place place_of(int at) {
    const int x = at % kSlotSize;
    const int y = at / kSlotSize;
    const auto step = [](int v) { return v == 0 ? 0 : v == kSlotSize - 1 ? 2 : 1; };
    return {texels(step(y) * 3 + step(x)), (x + kTileSize - 1) % kTileSize, (y + kTileSize - 1) % kTileSize};
  }

  std::optional<SurfacePoint> covered_point(int at, Sampler& sampler) {
    const auto place = place_of(at);
    if (place.texels == nullptr) return std::nullopt;
    return world_->covered_point(*place.texels, place.x, place.y, sampler);
  }

  TileId id_;
  LevelTiles level_;
  std::shared_ptr<const SurfaceWorld> world_;
  std::shared_ptr<const StoredLight> stored_;
  std::array<std::shared_ptr<const atlas::TileTexels>, 9> around_;
  std::array<bool, 9> asked_{};
};

class SceneSlots : public ViewSurfaces {
 public:
  explicit SceneSlots(std::shared_ptr<const SurfaceWorld> world) : world_(std::move(world)) {}
  [[nodiscard]] std::unique_ptr<ViewSurface> tile(TileId id, std::shared_ptr<const StoredLight> stored) const override {
    const auto& levels = world_->mapper->layout().levels;
    if (static_cast<std::size_t>(id.level()) >= levels.size()) return nullptr;
    const auto& level = levels[static_cast<std::size_t>(id.level())];
    if (id.index() >= level.tiles_x * level.tiles_y) return nullptr;
    return std::make_unique<SceneSlot>(id, LevelTiles{level.tiles_x, level.tiles_y}, world_, std::move(stored));
  }

 private:
  std::shared_ptr<const SurfaceWorld> world_;
};

}  // namespace

std::shared_ptr<const ViewSurfaces> make_view_surfaces(std::shared_ptr<const scene::Scene> scene,
                                                       std::shared_ptr<const atlas::TexelMapper> mapper,
                                                       std::shared_ptr<const LightTransport> transport,
                                                       std::uint64_t seed) {
  auto world = std::make_shared<SurfaceWorld>();
  world->scene = std::move(scene);
  world->mapper = std::move(mapper);
  world->transport = std::move(transport);
  world->seed = seed;
  return std::make_shared<SceneSlots>(std::move(world));
}

}  // namespace darm::renderer
