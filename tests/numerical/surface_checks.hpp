// What must hold of any layout, as figures: nothing lost, nothing flipped, areas kept, texels and surface inverse.
#pragma once

#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "actors/atlas/build_layout.hpp"
#include "actors/atlas/texel_map.hpp"
#include "tests/numerical/statistics.hpp"
#include "tests/numerical/worst.hpp"
#include "tests/unit/atlas/hand_made_scenes.hpp"

namespace darm::numerical {

class SurfaceChecks {
 public:
  /// Everything about one scene at a density.
  void look(const std::string& name, const scene::Scene& scene, float q) {
    auto made = atlas::build_layout(scene, {.q = q});
    ASSERT_TRUE(made) << name << ": " << made.error().message;
    const auto shared = std::make_shared<scene::Scene>(scene);
    look_at_triangles(name, scene, **made);
    look_at_texels(name, shared, *made);
  }

 private:
  static double twice_area(const std::array<glm::vec2, 3>& t) {
    const glm::dvec2 a(glm::dvec2(t[1]) - glm::dvec2(t[0])), b(glm::dvec2(t[2]) - glm::dvec2(t[0]));
    return a.x * b.y - a.y * b.x;
  }

  static glm::dvec3 place(const scene::Scene& s, const SurfacePoint& p) {
    const auto& instance = s.instances[p.instance];
    const auto& mesh = s.meshes[instance.mesh];
    const auto& t = mesh.triangles[p.triangle];
    const glm::dvec3 at = glm::dvec3(mesh.positions[t.x]) * (1.0 - double{p.u} - double{p.v}) +
                          glm::dvec3(mesh.positions[t.y]) * double{p.u} + glm::dvec3(mesh.positions[t.z]) * double{p.v};
    return {glm::dmat4(instance.to_world) * glm::dvec4(at, 1)};
  }

  void look_at_triangles(const std::string& name, const scene::Scene& s, const atlas::Layout& l) {
    std::uint64_t unplaced = 0, dropped = 0;
    for (const auto& d : l.dropped) dropped += d.count;
    for (std::size_t i = 0; i < l.instances.size(); ++i) {
      const auto& chart = l.charts[l.instances[i].chart];
      const auto& mesh = s.meshes[chart.mesh];
      const glm::dmat3 linear(glm::dmat4(s.instances[i].to_world));
      std::vector<double> flat(chart.patch_count), space(chart.patch_count);
      for (std::size_t t = 0; t < chart.uv.size(); ++t) {
        const auto p = chart.local_patch[t];
        if (p == atlas::kDroppedTriangle) {
          ++unplaced;
          continue;
        }
        const auto& k = mesh.triangles[t];
        const glm::dvec3 a(mesh.positions[k.x]), b(mesh.positions[k.y]), c(mesh.positions[k.z]);
        const double area = glm::length(glm::cross(linear * (b - a), linear * (c - a)));
        const double got = twice_area(chart.uv[t]);
        flat[p] += got;
        space[p] += area;
        const glm::dvec2 size(chart.patch_size[p]);
        // Corners are rounded to float: what that can turn over is no flip.
        flipped_.see(got < -4e-7 * size.y * (size.x + size.y) ? 1 : 0, name, "triangle", t);
      }
      for (std::size_t p = 0; p < flat.size(); ++p) area_.see(std::abs(flat[p] / space[p] - 1), name, "patch", p);
    }
    lost_.see(std::abs(static_cast<double>(unplaced) - static_cast<double>(dropped)), name);
  }

  /// The surface at a continuous texel position.
  static std::optional<SurfacePoint> surface_at(const atlas::TexelMapper& mapper, glm::vec2 texel) {
    const auto& level = mapper.layout().levels[0];
    const auto x = static_cast<std::uint32_t>(texel.x), y = static_cast<std::uint32_t>(texel.y);
    if (x >= level.width || y >= level.height) return std::nullopt;
    const auto tile = mapper.tile(TileId(0, y / kTileSize * level.tiles_x + x / kTileSize));
    return tile->sample(static_cast<int>(x % kTileSize), static_cast<int>(y % kTileSize),
                        texel - glm::vec2(static_cast<float>(x), static_cast<float>(y)));
  }

  static glm::vec2 texel_of(const atlas::Layout& l, const SurfacePoint& p) {
    return l.texel_at(l.patch_of(p.instance, p.triangle, p.front), 0, l.patch_uv(p.instance, p.triangle, p.u, p.v));
  }

  void look_at_texels(const std::string& name, const std::shared_ptr<const scene::Scene>& s,
                      const std::shared_ptr<const atlas::Layout>& l) {
    const atlas::TexelMapper mapper(s, l);
    const std::uint32_t points = scaled(3000u);
    for (std::uint32_t i = 0; i < points; ++i) {
      renderer::Sampler random(8, i, 0);
      SurfacePoint p;
      p.instance = static_cast<std::uint32_t>(random.next_1d() * static_cast<float>(s->instances.size()));
      const auto& triangles = s->meshes[s->instances[p.instance].mesh].triangles;
      p.triangle = static_cast<std::uint32_t>(random.next_1d() * static_cast<float>(triangles.size()));
      const glm::vec2 b = random.next_2d();
      p.u = 0.98f * b.x * (1 - b.y) + 0.005f;
      p.v = 0.98f * b.y + 0.005f;
      if (p.u + p.v > 0.995f) p.u = 0.995f - p.v;
      const auto patch = l->patch_of(p.instance, p.triangle, true);
      if (patch == kNoPatch || l->levels[0].placements[index_of(patch)].scale == 0) continue;
      const glm::vec2 texel = texel_of(*l, p);
      const auto back = surface_at(mapper, texel);
      if (!back || l->patch_of(back->instance, back->triangle, back->front) != patch) {
        surface_.see(1e9, name, "another patch's texel");
        continue;
      }
      surface_.see(glm::length(place(*s, *back) - place(*s, p)) * double{l->q}, name, "triangle", p.triangle);
      texel_.see(static_cast<double>(glm::length(texel_of(*l, *back) - texel)), name, "triangle", p.triangle);
    }
  }

  Worst lost_{"triangles neither placed nor counted as dropped", 0};
  Worst flipped_{"triangles flipped", 0};
  Worst area_{"flat area of a patch against its area in space, relative", 1e-4};
  Worst surface_{"surface -> texel -> surface, texels", 0.01};
  Worst texel_{"texel -> surface -> texel, texels", 2e-3};
};

}  // namespace darm::numerical
