// How much of what each instance shows depends on the eye: what the private layer of a session is worth there.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "actors/scene/scene.hpp"

namespace darm::scene {

/// View-dependent light of one material.
struct ViewMaterial {
  /// Expected display error (0..1) of leaving it out; 0: not worth a private tile.
  float weight = 0;
  /// The same without the coat of rough dielectrics: what a picture cannot do without (metal is black without it).
  float call = 0;
  /// Levels under the sharp one at which its light is kept: what a rough lobe reflects is smooth.
  std::uint8_t coarser = 0;
  float diffuse = 0;  ///< mean luminance of its diffuse albedo, 0..1
  /// Squared display error of leaving it out of a picture among kGreySurroundings, whether or not there is a private
  /// layer, by the cosine between eye and normal: equal parts of 0..1.
  std::array<float, 16> omitted{};

  /// `cosine`: anything under 0 and NaN are 0, over 1 is 1.
  [[nodiscard]] float squared_omitted(float cosine) const {
    const float last = static_cast<float>(omitted.size() - 1);
    const float at = cosine > 0 ? std::clamp(cosine * static_cast<float>(omitted.size()) - 0.5f, 0.0f, last) : 0.0f;
    const auto part = std::min(static_cast<std::size_t>(at), omitted.size() - 2);
    return omitted[part] + (omitted[part + 1] - omitted[part]) * (at - static_cast<float>(part));
  }
};

struct ViewMaterialOptions {
  float calls = 0.05f;  ///< a scene with a material of at least this call has a private layer
  float joins = 0.01f;  ///< and then everything of at least this weight is in it
};

/// Reads a material and a grid of points of its textures. The weight of a point: what a grey surrounding of display
/// value about .6 (kGreySurroundings) would add to its diffuse light, as a difference of display values, times 1 to 3
/// for lobes so narrow that they show what they reflect. Of the material: RMS over the points. What `omitted` counts is
/// seen at an angle (Schlick's Fresnel; rough coats stay under it), and from surroundings as they are: less light than
/// where the camera looks, which is at what is lit.
[[nodiscard]] ViewMaterial view_material(const Scene& scene, const Material& material);

/// What a thin clear surface passes of what is straight behind it, as a mean over a grid of points of its textures:
/// linear base colour * transmission * (1 - metallic), 0..1 a channel. Black where nothing comes through straight: no
/// transmission, or a volume, which refracts.
[[nodiscard]] glm::vec3 mean_passage(const Scene& scene, const Material& material);

/// The grey that `omitted` is meant for: linear radiance from everywhere, exposed.
inline constexpr float kGreySurroundings = 0.3f;

/// One per instance. All weights are 0 if nothing in the scene calls for a private layer.
[[nodiscard]] std::vector<ViewMaterial> view_materials(const Scene& scene, const ViewMaterialOptions& options = {});

/// True if some instance has weight.
[[nodiscard]] bool calls_for_view_layer(const std::vector<ViewMaterial>& materials);

}  // namespace darm::scene
