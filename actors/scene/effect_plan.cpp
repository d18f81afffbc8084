#include "actors/scene/effect_plan.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "actors/scene/view_materials.hpp"

namespace darm::scene {
namespace {

std::string counted(std::size_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

bool reflects_diffusely(const Material& m) {
  return !m.unlit && (m.base_color_texture.present() || m.base_color.x + m.base_color.y + m.base_color.z > 0.0f) &&
         (m.metallic < 1.0f || m.metallic_roughness_texture.present()) && m.transmission < 1.0f;
}

bool has_volume(const Material& m) {
  const bool tints = m.attenuation_color.x < 1.0f || m.attenuation_color.y < 1.0f || m.attenuation_color.z < 1.0f;
  return m.transmission > 0.0f && m.thickness > 0.0f && m.attenuation_distance > 0.0f && tints;
}

bool has_texture(const Material& m) {
  return m.base_color_texture.present() || m.metallic_roughness_texture.present() || m.normal_texture.present() ||
         m.emissive_texture.present() || m.transmission_texture.present();
}

/// Counts over one scene; materials and meshes count only where an instance shows them.
class Survey {
 public:
  explicit Survey(const Scene& scene)
      : scene_(scene), mesh_used_(scene.meshes.size()), material_used_(scene.materials.size()) {
    for (const Instance& i : scene.instances) {
      mesh_used_[i.mesh] = true;
      material_used_[scene.meshes[i.mesh].material] = true;
    }
  }

  [[nodiscard]] std::size_t materials(const std::function<bool(const Material&)>& has) const {
    std::size_t n = 0;
    for (std::size_t i = 0; i < scene_.materials.size(); ++i) n += material_used_[i] && has(scene_.materials[i]);
    return n;
  }
  [[nodiscard]] std::size_t meshes(const std::function<bool(const Mesh&)>& has) const {
    std::size_t n = 0;
    for (std::size_t i = 0; i < scene_.meshes.size(); ++i) n += mesh_used_[i] && has(scene_.meshes[i]);
    return n;
  }
  [[nodiscard]] std::size_t lights(const std::function<bool(const Light&)>& has) const {
    return static_cast<std::size_t>(std::ranges::count_if(scene_.lights, has));
  }
  [[nodiscard]] std::size_t moving_bodies() const {
    std::vector<bool> moves(scene_.objects.size());
    for (const Instance& i : scene_.instances)
      if (i.object < moves.size()) moves[i.object] = scene_.objects[i.object].dynamic;
    return static_cast<std::size_t>(std::ranges::count(moves, true));
  }

 private:
  const Scene& scene_;
  std::vector<bool> mesh_used_;
  std::vector<bool> material_used_;
};

class Plan {
 public:
  /// Adds an effect needed when count > 0; the reason is the count with its noun, or "no <nouns>".
  bool add(const std::string& name, std::size_t count, const std::string& one, const std::string& many) {
    out.effects.push_back({name, count > 0, count > 0 ? counted(count, one, many) : "no " + many});
    return count > 0;
  }
  EffectPlan out;
};

void plan_lights(Plan& plan, const Scene& scene, const Survey& survey) {
  const auto is_delta = [](const Light& l) { return l.angular_diameter <= 0.0f; };
  const std::size_t suns = survey.lights([&](const Light& l) { return !is_delta(l); });
  const std::size_t emitters = survey.materials([](const Material& m) { return m.emits() || m.unlit; });
  plan.out.delta_lights = plan.add("delta lights", survey.lights(is_delta), "point, spot or directional light",
                                   "point, spot or directional lights");
  plan.out.area_lights = suns + emitters > 0;
  plan.out.emitters = emitters > 0;
  plan.out.suns = survey.lights([](const Light& l) { return l.kind == LightKind::kDirectional; }) > 0;
  plan.out.lamps = survey.lights([](const Light& l) { return l.kind != LightKind::kDirectional; }) > 0;
  plan.out.effects.push_back({"area lights", plan.out.area_lights,
                              plan.out.area_lights ? counted(emitters, "emissive material", "emissive materials") +
                                                         ", " + counted(suns, "disc sun", "disc suns")
                                                   : "no emissive materials, no disc sun"});
  plan.out.sky = scene.sky.emits();
  plan.out.effects.push_back({"sky", plan.out.sky, plan.out.sky ? "the sky emits" : "the sky is black"});
}

void plan_materials(Plan& plan, const Survey& survey) {
  const auto materials = [&](const char* name, const char* noun, const std::function<bool(const Material&)>& has) {
    return plan.add(name, survey.materials(has), std::string("material ") + noun, std::string("materials ") + noun);
  };
  EffectPlan& out = plan.out;
  out.alpha_test =
      materials("alpha test", "with alpha MASK", [](const Material& m) { return m.alpha_mode == AlphaMode::kMask; });
  out.blending =
      materials("blending", "with alpha BLEND", [](const Material& m) { return m.alpha_mode == AlphaMode::kBlend; });
  out.diffuse_interreflection = materials("diffuse interreflection", "that reflect diffusely", reflects_diffusely);
  // Every lit dielectric has a specular lobe; only an index of 1 switches it off.
  out.glossy_reflection = materials("glossy reflection", "with a specular lobe",
                                    [](const Material& m) { return !m.unlit && (m.metallic > 0.0f || m.ior != 1.0f); });
  // Light goes straight through thin clear material, and through a volume without a boundary.
  out.straight_passage = out.blending || survey.materials([](const Material& m) {
    return m.transmission > 0.0f && (m.thickness <= 0.0f || std::abs(m.ior - 1.0f) <= 1e-4f);
  }) > 0;
  out.transmission =
      materials("transmission", "that transmit light", [](const Material& m) { return m.transmission > 0.0f; });
  out.volume_attenuation = materials("volume attenuation", "with an absorbing volume", has_volume);
  out.normal_maps =
      materials("normal maps", "with a normal map", [](const Material& m) { return m.normal_texture.present(); });
  out.vertex_colors = plan.add("vertex colours", survey.meshes([](const Mesh& m) { return !m.colors.empty(); }),
                               "mesh with vertex colours", "meshes with vertex colours");
  out.textures = materials("textures", "with textures", has_texture);
}

}  // namespace

EffectPlan plan_effects(const Scene& scene) {
  const Survey survey(scene);
  Plan plan;
  plan_lights(plan, scene, survey);
  plan_materials(plan, survey);
  const std::size_t moving =
      survey.lights([&](const Light& l) { return l.object < scene.objects.size() && scene.objects[l.object].dynamic; });
  plan.out.moving_lights = plan.add("moving lights", moving, "light on a movable node", "lights on movable nodes");
  plan.out.moving_bodies = plan.add("moving bodies", survey.moving_bodies(), "movable body", "movable bodies");
  const auto view = view_materials(scene);
  const auto shown = static_cast<std::size_t>(std::ranges::count_if(view, [](const auto& m) { return m.weight > 0; }));
  plan.out.view_layer = plan.add("private layer", shown, "instance whose light depends on the eye",
                                 "instances whose light depends on the eye enough");
  return std::move(plan.out);
}

}  // namespace darm::scene
