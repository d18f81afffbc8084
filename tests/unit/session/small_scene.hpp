// A grid of triangles with a layout of its own, small enough to check by hand.
#pragma once

#include "actors/atlas/layout.hpp"
#include "actors/scene/scene.hpp"

namespace darm::session::testing {

/// `side` x `side` squares of two triangles each in the plane y = 0, one patch per row, placed twice: at the origin and
/// at x = 1000. The first triangle has no texels.
inline std::pair<scene::Scene, atlas::Layout> grid(std::uint32_t side) {
  scene::Scene s;
  s.path = "a/grid.glb";
  s.hash = 42;
  s.origin = {5, 6, 7};
  s.materials.emplace_back();
  s.objects.push_back({"grid", true});
  auto& mesh = s.meshes.emplace_back();
  atlas::Chart chart;
  for (std::uint32_t y = 0; y <= side; ++y) {
    for (std::uint32_t x = 0; x <= side; ++x) mesh.positions.emplace_back(float(x), 0.0f, float(y));
  }
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const auto a = y * (side + 1) + x;
      for (const auto& t : {glm::uvec3(a, a + 1, a + side + 1), glm::uvec3(a + 1, a + side + 2, a + side + 1)}) {
        mesh.triangles.push_back(t);
        chart.local_patch.push_back(y);
        std::array<glm::vec2, 3> uv;
        for (int c = 0; c < 3; ++c) uv[std::size_t(c)] = {mesh.positions[t[c]].x, mesh.positions[t[c]].z - float(y)};
        chart.uv.push_back(uv);
      }
    }
  }
  chart.local_patch[0] = atlas::kDroppedTriangle;
  chart.patch_count = side;
  atlas::Layout l;
  l.q = 8;
  l.patch_count = side * 2;
  for (std::uint32_t i = 0; i < 2; ++i) {
    scene::Instance instance;
    instance.to_world[3][0] = i == 0 ? 0.0f : 1000.0f;
    s.instances.push_back(instance);
    atlas::InstanceCharts ic;
    ic.front_base = i * side;
    l.instances.push_back(ic);
  }
  l.charts.push_back(std::move(chart));
  for (int level = 0; level < 2; ++level) {
    atlas::Level info;
    info.density = level == 0 ? 8.0f : 4.0f;
    info.width = info.height = 30;
    info.tiles_x = info.tiles_y = 1;
    for (std::uint32_t p = 0; p < l.patch_count; ++p) info.placements.push_back({p, p * 2, level == 0 ? 1.0f : 0.5f});
    l.levels.push_back(info);
  }
  return {std::move(s), std::move(l)};
}

}  // namespace darm::session::testing
