#include "actors/renderer/effects.hpp"

#include <array>
#include <utility>

namespace darm::renderer {

Effects effects_of(const scene::EffectPlan& plan) {
  Effects needed;
  needed.suns = plan.suns;
  needed.lamps = plan.lamps;
  needed.emitters = plan.emitters;
  needed.sky = plan.sky;
  needed.straight = plan.straight_passage;
  needed.glossy = plan.glossy_reflection;
  needed.transmission = plan.transmission;
  needed.normal_maps = plan.normal_maps;
  needed.textures = plan.textures || plan.vertex_colors;
  return needed;
}

std::string to_string(const Effects& e) {
  const std::array<std::pair<bool, const char*>, 9> parts = {{{e.suns, "suns"},
                                                              {e.lamps, "point lights"},
                                                              {e.emitters, "emissive surfaces"},
                                                              {e.sky, "sky"},
                                                              {e.straight, "straight passage"},
                                                              {e.glossy, "specular lobes"},
                                                              {e.transmission, "transmission and volumes"},
                                                              {e.normal_maps, "normal maps"},
                                                              {e.textures, "textures and vertex colours"}}};
  std::string out;
  for (const auto& [on, name] : parts)
    if (on) out += (out.empty() ? "" : ", ") + std::string(name);
  return out.empty() ? "none" : out;
}

}  // namespace darm::renderer
