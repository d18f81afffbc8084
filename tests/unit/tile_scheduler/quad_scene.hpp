// Hand-made scenes of one-patch quads with a layout whose levels are simple rows of boxes.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/renderer/trace/ray_scene.hpp"
#include "actors/scene/scene.hpp"

namespace darm::tile_scheduler::testing {

/// A rectangle origin + s * right + t * up, s in [0, width], t in [0, height]; its front is where right x up points.
struct Quad {
  glm::vec3 origin{0.0f};
  glm::vec3 right{1, 0, 0};
  glm::vec3 up{0, 1, 0};
  float width = 1;
  float height = 1;
  scene::AlphaMode alpha = scene::AlphaMode::kOpaque;
  bool double_sided = false;
};

struct TestWorld {
  std::shared_ptr<const scene::Scene> scene;
  std::shared_ptr<const atlas::Layout> layout;
  std::shared_ptr<const renderer::trace::RayScene> rays;
};

/// One instance, mesh and chart per quad; patches in order of the quads (front, then back if double-sided).
inline TestWorld make_world(const std::vector<Quad>& quads, float q, int levels) {
  auto scene = std::make_shared<scene::Scene>();
  auto layout = std::make_shared<atlas::Layout>();
  layout->q = q;
  std::vector<glm::vec2> sizes;
  for (const auto& quad : quads) {
    const auto number = static_cast<std::uint32_t>(scene->meshes.size());
    scene::Material material;
    material.alpha_mode = quad.alpha;
    material.double_sided = quad.double_sided;
    scene->materials.push_back(material);
    scene::Mesh mesh;
    const glm::vec3 r = quad.right * quad.width;
    const glm::vec3 u = quad.up * quad.height;
    mesh.positions = {quad.origin, quad.origin + r, quad.origin + r + u, quad.origin + u};
    for (const auto& corner : mesh.positions) {
      scene->bounds_min = glm::min(scene->bounds_min, corner);
      scene->bounds_max = glm::max(scene->bounds_max, corner);
    }
    mesh.normals.assign(4, glm::cross(quad.right, quad.up));
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.material = number;
    scene->meshes.push_back(mesh);
    scene::Instance instance;
    instance.mesh = number;
    scene->instances.push_back(instance);
    atlas::Chart chart;
    chart.mesh = number;
    chart.patch_count = 1;
    chart.local_patch = {0, 0};
    const float w = quad.width;
    const float h = quad.height;
    chart.uv = {{glm::vec2{0, 0}, {w, 0}, {w, h}}, {glm::vec2{0, 0}, {w, h}, {0, h}}};
    chart.patch_size = {{w, h}};
    chart.patch_area = {w * h};
    layout->charts.push_back(chart);
    atlas::InstanceCharts charts;
    charts.chart = number;
    charts.front_base = static_cast<std::uint32_t>(sizes.size());
    sizes.emplace_back(w, h);
    if (quad.double_sided) {
      charts.back_base = static_cast<std::uint32_t>(sizes.size());
      sizes.emplace_back(w, h);
    }
    layout->instances.push_back(charts);
  }
  scene->objects.emplace_back();
  layout->patch_count = static_cast<std::uint32_t>(sizes.size());
  for (int l = 0; l < levels; ++l) {
    atlas::Level level;
    level.density = q / static_cast<float>(1 << l);
    std::uint32_t y = 0;
    std::uint32_t width = 1;
    for (const auto& size : sizes) {
      level.placements.push_back({0, y, 1.0f});
      width = std::max(width, static_cast<std::uint32_t>(std::ceil(size.x * level.density)) + 2);
      y += static_cast<std::uint32_t>(std::ceil(size.y * level.density)) + 2;
    }
    level.tiles_x = (width + kTileSize - 1) / kTileSize;
    level.tiles_y = (y + kTileSize - 1) / kTileSize;
    level.width = level.tiles_x * kTileSize;
    level.height = level.tiles_y * kTileSize;
    layout->levels.push_back(level);
  }
  TestWorld world;
  auto rays = renderer::trace::RayScene::build(scene, 1);
  world.scene = scene;
  world.layout = layout;
  world.rays = rays.value();
  return world;
}

/// A room of quads at several distances and angles, one see-through.
inline TestWorld make_room() {
  std::vector<Quad> quads;
  quads.push_back({{-4, -1, 2}, {1, 0, 0}, {0, 0, -1}, 8, 12});  // floor
  quads.push_back({{-4, -1, -10}, {1, 0, 0}, {0, 1, 0}, 8, 4});  // far wall
  quads.push_back({{-4, -1, 2}, {0, 0, -1}, {0, 1, 0}, 12, 4});  // left wall, faces +X
  quads.push_back({{-1, -0.5f, -3}, {1, 0, 0}, {0, 1, 0}, 1, 1, scene::AlphaMode::kBlend, true});  // pane
  quads.push_back({{1, -1, -4}, {1, 0, 0}, {0, 1, 0}, 0.6f, 2});
  return make_world(quads, 64, 5);
}

}  // namespace darm::tile_scheduler::testing
