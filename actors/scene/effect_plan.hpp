// Which effects of light a scene calls for, read off its materials and lights once at load (DESIGN section 6).
#pragma once

#include <string>
#include <vector>

#include "actors/scene/scene.hpp"

namespace darm::scene {

/// One effect, whether the scene needs it, and why (or why not): "3 materials with alpha MASK", "no clear materials".
struct Effect {
  std::string name;
  bool needed = false;
  std::string reason;
};

/// Read-only. A flag may be true although the effect turns out invisible, never false although it is visible.
struct EffectPlan {
  bool delta_lights = false;  ///< point, spot and directional lights without extent
  bool area_lights = false;   ///< emissive surfaces or a disc sun
  bool sky = false;
  bool alpha_test = false;  ///< MASK
  bool blending = false;    ///< BLEND
  bool diffuse_interreflection = false;
  bool glossy_reflection = false;
  bool transmission = false;
  bool volume_attenuation = false;
  bool normal_maps = false;
  bool vertex_colors = false;
  bool textures = false;
  bool moving_lights = false;
  bool moving_bodies = false;
  bool view_layer = false;      ///< enough of some surface's light depends on the eye (view_materials.hpp)
  std::vector<Effect> effects;  ///< the same, in this order, with reasons
};

[[nodiscard]] EffectPlan plan_effects(const Scene& scene);

}  // namespace darm::scene
