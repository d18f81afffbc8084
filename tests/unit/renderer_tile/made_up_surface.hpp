// A surface made up for tests: light and albedo are functions, patches split a tile in columns.
#pragma once

#include <functional>
#include <random>

#include "actors/renderer/tile_surface.hpp"

namespace darm::renderer {

/// Both layers of one sample, as radiance that leaves the texel.
struct TexelLight {
  glm::vec3 sharp{0.0f};
  glm::vec3 soft{0.0f};
};

struct MadeUpLight {
  std::function<std::uint32_t(TileId, int x, int y)> patch = [](TileId, int, int) { return 0u; };
  std::function<TexelLight(TileId, int texel, std::uint32_t sample)> light = [](TileId, int, std::uint32_t) {
    return TexelLight{glm::vec3(0.0f), glm::vec3(0.25f)};
  };
  std::function<void(TileId, int texel, std::uint32_t sample)> sharp_asked = [](TileId, int, std::uint32_t) {};
  std::function<void(TileId, int texel, std::uint32_t sample)> soft_asked = [](TileId, int, std::uint32_t) {};
  std::function<glm::vec3(TileId, int x, int y)> albedo = [](TileId, int, int) { return glm::vec3(0.5f); };
  std::function<float(TileId, int x, int y)> alpha = [](TileId, int, int) { return 1.0f; };
  std::function<TileWalls(TileId)> walls = [](TileId) { return TileWalls{}; };
  bool translucent = false;
  glm::vec3 emission{0.0f};
};

class MadeUpTile : public TileSurface {
 public:
  MadeUpTile(TileId id, const MadeUpLight& world) : id_(id), world_(world) {}
  [[nodiscard]] std::uint32_t patch(int t) const override { return world_.patch(id_, t % kTileSize, t / kTileSize); }
  [[nodiscard]] std::optional<glm::vec3> sharp(int t, std::uint32_t sample) const override {
    world_.sharp_asked(id_, t, sample);
    return world_.light(id_, t, sample).sharp / *albedo(t, sample);
  }
  [[nodiscard]] std::optional<glm::vec3> soft(int t, std::uint32_t sample) const override {
    world_.soft_asked(id_, t, sample);
    return world_.light(id_, t, sample).soft / *albedo(t, sample);
  }
  [[nodiscard]] std::optional<glm::vec3> albedo(int t, std::uint32_t) const override {
    return world_.albedo(id_, t % kTileSize, t / kTileSize);
  }
  [[nodiscard]] glm::vec3 emission(int, std::uint32_t) const override { return world_.emission; }
  [[nodiscard]] bool emits() const override { return world_.emission.x > 0; }
  [[nodiscard]] std::optional<float> alpha(int t, std::uint32_t) const override {
    return world_.alpha(id_, t % kTileSize, t / kTileSize);
  }
  [[nodiscard]] bool translucent() const override { return world_.translucent; }
  [[nodiscard]] TileWalls walls() const override { return world_.walls(id_); }

 private:
  TileId id_;
  const MadeUpLight& world_;
};

class MadeUpWorld : public TileSurfaces {
 public:
  MadeUpLight world;
  [[nodiscard]] std::shared_ptr<const TileSurface> tile(TileId id) const override {
    return std::make_shared<MadeUpTile>(id, world);
  }
};

/// Uniform in [0, 1), a function of tile, texel and sample number.
inline float noise_of(TileId tile, int texel, std::uint32_t sample) {
  std::uint64_t h = (std::uint64_t{tile.packed} << 32) ^ (static_cast<std::uint64_t>(texel) << 20) ^ sample;
  for (int i = 0; i < 2; ++i) {
    h ^= h >> 30;
    h *= 0xbf58476d1ce4e5b9ull;
    h ^= h >> 27;
    h *= 0x94d049bb133111ebull;
    h ^= h >> 31;
  }
  return static_cast<float>(h >> 40) / 16777216.0f;
}

}  // namespace darm::renderer
