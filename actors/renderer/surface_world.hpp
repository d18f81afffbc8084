// What the surfaces of shared and of private tiles are made from, and which of a texel's points they sample.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>

#include "actors/atlas/texel_map.hpp"
#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/sampler.hpp"
#include "actors/scene/scene.hpp"
#include "actors/scene/texture_sampling.hpp"

namespace darm::renderer {

/// Immutable once filled in; thread-safe.
struct SurfaceWorld {
  std::shared_ptr<const scene::Scene> scene;
  std::shared_ptr<const atlas::TexelMapper> mapper;
  std::shared_ptr<const LightTransport> transport;
  std::uint64_t seed = 0;

  [[nodiscard]] const scene::Material& material_of(std::uint32_t instance) const {
    return scene->materials[scene->meshes[scene->instances[instance].mesh].material];
  }

  /// 1 unless MASK or BLEND. MASK: 0 or 1.
  [[nodiscard]] float alpha(const SurfacePoint& p) const {
    const auto& mesh = scene->meshes[scene->instances[p.instance].mesh];
    const auto& m = scene->materials[mesh.material];
    if (m.alpha_mode == scene::AlphaMode::kOpaque) return 1.0f;
    float a = m.base_color.w * scene::interpolate_color(mesh, p.triangle, p.u, p.v).w;
    if (m.base_color_texture.present())
      a *= scene::sample(*scene, m.base_color_texture, mesh, p.triangle, p.u, p.v, scene::TextureEncoding::kSrgb).w;
    if (m.alpha_mode == scene::AlphaMode::kMask) return a >= m.alpha_cutoff ? 1.0f : 0.0f;
    return std::clamp(a, 0.0f, 1.0f);
  }

  /// A point of a texel by the next numbers of `sampler`, off the edges of its triangle, so that no ray begins beyond
  /// the wall that meets it there. A texel half cut away shows the colour of its other half: points that MASK cuts are
  /// drawn again, up to eight times. nullopt: nothing under the texel.
  [[nodiscard]] std::optional<SurfacePoint> covered_point(const atlas::TileTexels& texels, int x, int y,
                                                          Sampler& sampler) const {
    constexpr int kTries = 8;
    auto point = texels.sample(x, y, sampler.next_2d());
    if (!point) return point;
    if (material_of(point->instance).alpha_mode == scene::AlphaMode::kMask)
      for (int i = 0; i < kTries && alpha(*point) == 0.0f; ++i)
        if (const auto again = texels.sample(x, y, sampler.next_2d())) point = again;
    return trace::off_edges(transport->rays(), *point);
  }
};

}  // namespace darm::renderer
