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
  bool view_layer = false;  ///< enough of some surface's light depends on the eye (view_materials.hpp)
  // Parts of the above that code can do without:
  bool suns = false;              ///< directional lights, delta or disc
  bool lamps = false;             ///< point and spot lights
  bool emitters = false;          ///< emissive or unlit surfaces
  bool straight_passage = false;  ///< BLEND, or clear material that light passes unbent
  std::vector<Effect> effects;    ///< those with a name, in this order, with reasons
};

/// Pure: a scene that has changed (a light that moves, a body marked movable, a material that turns clear) is a new
/// Scene with a plan of its own.
[[nodiscard]] EffectPlan plan_effects(const Scene& scene);

}  // namespace darm::scene
