// A room whose coarse level is lit by a function of place, as paths find it with and without its bright texels.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "actors/atlas/build_layout.hpp"
#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/stored_light.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::renderer {

/// Closed, four metres wide, of albedo one half, a block on its floor.
struct LitRoom {
  explicit LitRoom(const std::function<float(const glm::vec3&)>& light) {
    test::HandScene hand;
    const auto grey = hand.material(test::HandScene::matte(glm::vec3(kAlbedo)));
    hand.box(glm::vec3(-2), glm::vec3(2), grey, true);
    hand.box(glm::vec3(0.5f, -2, 0.5f), glm::vec3(1.5f, -0.5f, 1.5f), grey, false);
    scene = hand.share();
    rays = trace::RayScene::build(scene, 1).value();
    layout = atlas::build_layout(*scene, {.q = 64}).value();
    mapper = std::make_unique<atlas::TexelMapper>(scene, layout);
    transport = std::make_unique<LightTransport>(scene, rays);
    for (auto* stored : {&plain, &aimed}) *stored = std::make_unique<StoredLight>(layout);
    const auto& level = layout->levels.back();
    for (std::uint32_t t = 0; t < level.tiles_x * level.tiles_y; ++t) {
      const auto tile = mapper->tile(TileId(layout->coarse_level(), t));
      std::vector<StoredTexel> texels(kTileTexels);
      for (int i = 0; i < kTileTexels; ++i)
        if (const auto point = tile->center(i % kTileSize, i / kTileSize))
          texels[static_cast<std::size_t>(i)] = {glm::vec3(0.0f),
                                                 glm::vec3(light(trace::make_surface(*rays, *point).position)), true};
      for (auto* stored : {&plain, &aimed}) (*stored)->put(t, texels);
    }
    aimed->give_bright(BrightTexels(*aimed, *mapper, *transport));
  }

  static constexpr float kAlbedo = 0.5f;

  /// What a ray meets; the room is closed.
  [[nodiscard]] SurfacePoint seen(const glm::vec3& from, const glm::vec3& direction) const {
    trace::Hit hit;
    return rays->closest({from, 0.0f, direction, 100.0f}, hit)
               ? SurfacePoint{hit.instance, hit.triangle, hit.u, hit.v, hit.front}
               : SurfacePoint{};
  }

  std::shared_ptr<const scene::Scene> scene;
  std::shared_ptr<const trace::RayScene> rays;
  std::shared_ptr<const atlas::Layout> layout;
  std::unique_ptr<atlas::TexelMapper> mapper;
  std::unique_ptr<LightTransport> transport;
  std::unique_ptr<StoredLight> plain, aimed;
};

/// A spot of half a metre on the ceiling, bright enough for nearly all of the room's light to be rare.
inline constexpr float kRoomLight = 0.5f;
[[nodiscard]] inline glm::vec3 spot_middle() { return {-0.6f, 2, -0.4f}; }
[[nodiscard]] inline float spot_light(const glm::vec3& at) {
  const float off = glm::length(at - spot_middle());
  return off < 0.25f ? 400.0f * (1 - off / 0.25f) : kRoomLight;
}

}  // namespace darm::renderer
