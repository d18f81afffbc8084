#include "actors/renderer/material_point.hpp"

namespace darm::renderer {

MaterialPoint make_material_point(const scene::Scene& scene, const trace::WorldInstance& placed, std::uint32_t triangle,
                                  float u, float v) {
  const scene::HitTextures textures(placed.textures, *placed.mesh, triangle, u, v);
  return read_material<kAllEffects>(scene, placed, {triangle, u, v}, textures, thread_tally());
}

glm::vec3 emitted_radiance(const scene::Scene& scene, const trace::WorldInstance& placed, std::uint32_t triangle,
                           float u, float v) {
  const auto& m = *placed.material;
  if (!m.emissive_texture.present()) return m.emissive;
  return m.emissive * glm::vec3(scene::sample(scene, m.emissive_texture, *placed.mesh, triangle, u, v,
                                              scene::TextureEncoding::kSrgb));
}

}  // namespace darm::renderer
