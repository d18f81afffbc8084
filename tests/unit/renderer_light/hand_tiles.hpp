// A scene made by hand under a bright sky, with the surfaces of its tiles.
#pragma once

#include <cmath>
#include <memory>

#include "actors/atlas/build_layout.hpp"
#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/tile_surface_scene.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::renderer {

struct HandTiles {
  HandTiles(test::HandScene& hand, float q) {
    hand.scene.sky = {glm::vec3(1000), glm::vec3(1000), glm::vec3(1000)};
    scene = hand.share();
    layout = atlas::build_layout(*scene, {.q = q}).value();
    rays = trace::RayScene::build(scene, 1).value();
    mapper = std::make_shared<atlas::TexelMapper>(scene, layout);
    surfaces = make_scene_surfaces(scene, mapper, std::make_shared<LightTransport>(scene, rays), 5);
  }
  /// Calls f(tile, its surface) for every tile of a level.
  template <class F>
  void each_tile(int level, F&& f) const {
    const auto& l = layout->levels[static_cast<std::size_t>(level)];
    for (std::uint32_t t = 0; t < l.tiles_x * l.tiles_y; ++t) f(t, *surfaces->tile(TileId(level, t)));
  }

  std::shared_ptr<const scene::Scene> scene;
  std::shared_ptr<const atlas::Layout> layout;
  std::shared_ptr<const trace::RayScene> rays;
  std::shared_ptr<const atlas::TexelMapper> mapper;
  std::shared_ptr<TileSurfaces> surfaces;
};

/// A floor in one piece (instance 0), 4 m a side, and a wall 1 cm thick across it at x = `wall`.
inline test::HandScene parted_floor(float wall) {
  test::HandScene hand;
  const auto matte = hand.material(test::HandScene::matte(glm::vec3(0.5f)));
  hand.quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, matte);
  hand.box({wall - 0.005f, 0, -2}, {wall + 0.005f, 1, 2}, matte, false);
  return hand;
}

/// A round column of 60 cm, 3 m high.
inline test::HandScene round_column() {
  constexpr int kFacets = 64;
  test::HandScene hand;
  scene::Mesh column;
  for (int i = 0; i <= kFacets; ++i)
    for (const float y : {0.0f, 3.0f}) {
      const float angle = 2 * 3.14159265f * static_cast<float>(i) / kFacets;
      const glm::vec3 n(std::cos(angle), 0, std::sin(angle));
      column.positions.push_back(0.3f * n + glm::vec3(0, y, 0));
      column.normals.push_back(n);
      column.uvs[0].emplace_back(static_cast<float>(i) / kFacets, y / 3);
    }
  for (std::uint32_t i = 0; i < kFacets; ++i) {
    const std::uint32_t a = 2 * i;
    column.triangles.emplace_back(a, a + 1, a + 3);
    column.triangles.emplace_back(a, a + 3, a + 2);
  }
  column.material = hand.material(test::HandScene::matte(glm::vec3(0.5f)));
  hand.place(column);
  return hand;
}

}  // namespace darm::renderer
