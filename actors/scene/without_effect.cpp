#include "actors/scene/without_effect.hpp"

#include <algorithm>
#include <functional>
#include <map>

namespace darm::scene {
namespace {

using Edit = std::function<void(Scene&)>;

Edit each_material(const std::function<void(Material&)>& edit) {
  return [edit](Scene& s) { std::ranges::for_each(s.materials, edit); };
}

void drop_lights(Scene& s, bool with_extent) {
  std::erase_if(s.lights, [&](const Light& l) { return (l.angular_diameter > 0) == with_extent; });
}

void drop_textures(Material& m) {
  for (auto* t : {&m.base_color_texture, &m.metallic_roughness_texture, &m.normal_texture, &m.emissive_texture,
                  &m.transmission_texture})
    *t = TextureRef{};
}

void make_matte(Material& m) {
  m.metallic = 0;
  m.ior = 1;
  m.metallic_roughness_texture = TextureRef{};
}

void make_opaque(Material& m, AlphaMode from) {
  if (m.alpha_mode == from) m.alpha_mode = AlphaMode::kOpaque;
}

const std::map<std::string_view, Edit>& edits() {
  static const std::map<std::string_view, Edit> all = {
      {"delta lights", [](Scene& s) { drop_lights(s, false); }},
      {"area lights",
       [](Scene& s) {
         drop_lights(s, true);
         for (auto& m : s.materials) {
           m.emissive = glm::vec3(0.0f);
           m.unlit = false;
         }
       }},
      {"sky", [](Scene& s) { s.sky = Sky{}; }},
      {"alpha test", each_material([](Material& m) { make_opaque(m, AlphaMode::kMask); })},
      {"blending", each_material([](Material& m) { make_opaque(m, AlphaMode::kBlend); })},
      {"glossy reflection", each_material(make_matte)},
      {"transmission", each_material([](Material& m) { m.transmission = 0; })},
      {"volume attenuation", each_material([](Material& m) { m.attenuation_distance = 0; })},
      {"normal maps", each_material([](Material& m) { m.normal_texture = TextureRef{}; })},
      {"vertex colours",
       [](Scene& s) {
         for (auto& mesh : s.meshes) mesh.colors.clear();
       }},
      {"textures", each_material(drop_textures)},
  };
  return all;
}

}  // namespace

std::shared_ptr<const Scene> without_effect(const Scene& scene, std::string_view effect) {
  const auto edit = edits().find(effect);
  if (edit == edits().end()) return nullptr;
  auto copy = std::make_shared<Scene>(scene);
  edit->second(*copy);
  return copy;
}

}  // namespace darm::scene
