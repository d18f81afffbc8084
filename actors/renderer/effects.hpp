// Which effects of light an integrator's code holds: a value at compile time, a template's argument.
#pragma once

#include <string>

#include "actors/scene/effect_plan.hpp"

namespace darm::renderer {

/// A part that is false is not compiled in. Diffuse reflection always is. Alpha MASK is not among them: it lives in the
/// ray library's filters, which stand only on geometry that has it (trace::RayScene).
struct Effects {
  bool suns = false;      ///< directional lights, delta or disc
  bool lamps = false;     ///< point and spot lights
  bool emitters = false;  ///< emissive and unlit surfaces
  bool sky = false;
  bool straight = false;      ///< surfaces that light passes unbent: BLEND, thin clear, volumes without a boundary
  bool glossy = false;        ///< specular lobes: metal, and every dielectric whose index is not 1
  bool transmission = false;  ///< rough and refracting transmission, volume attenuation
  bool normal_maps = false;
  bool textures = false;  ///< of any other kind, and vertex colours

  [[nodiscard]] constexpr bool operator==(const Effects&) const = default;

  /// True if an integrator with these effects holds all that `needed` has.
  [[nodiscard]] constexpr bool cover(const Effects& needed) const {
    return (suns || !needed.suns) && (lamps || !needed.lamps) && (emitters || !needed.emitters) &&
           (sky || !needed.sky) && (straight || !needed.straight) && (glossy || !needed.glossy) &&
           (transmission || !needed.transmission) && (normal_maps || !needed.normal_maps) &&
           (textures || !needed.textures);
  }
};

inline constexpr Effects kAllEffects{true, true, true, true, true, true, true, true, true};

/// What the plan calls for.
[[nodiscard]] Effects effects_of(const scene::EffectPlan& plan);

/// "suns, sky, specular lobes": for people; "none" if it has none.
[[nodiscard]] std::string to_string(const Effects& effects);

}  // namespace darm::renderer
