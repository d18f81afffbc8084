// What a texel without samples of its own shows: light that the coarse level has of its place.
#pragma once

#include <glm/vec3.hpp>

namespace darm::renderer {

/// Light of a place on a finer level, as the coarse level's texels around it have it. Irradiance / pi, nits.
struct LightGuess {
  glm::vec3 sharp{0.0f};
  glm::vec3 soft{0.0f};
  float sharp_spread = 0;  ///< variance of the luminance of `sharp` among those texels, nits squared
  float soft_spread = 0;
  float sharp_around = 0;  ///< the same among the sixteen around the place
  float soft_around = 0;
  float soft_noise = 0;     ///< variance of the luminance of `soft` for want of samples
  bool surrounded = false;  ///< most of the sixteen are known
  bool lone = false;        ///< all of the patch is one texel
};

/// One layer of a texel's light, nits.
struct LayerLight {
  glm::vec3 mean{0.0f};
  float variance = 0;  ///< expected square error of the mean's luminance
  float texels = 1;    ///< over so many around it that error is the same, >= 1
};

/// A layer of a guess with its error: the spread of the texels it comes from and a fifth of its value for what is finer
/// than they are, but no more than light varies around the place: where that is smooth, so is what is finer. A patch of
/// one texel has the noise of that one. Measured by guess_bench (ARCHITECTURE.md, decision 26).
[[nodiscard]] LayerLight sharp_of(const LightGuess& guess);
[[nodiscard]] LayerLight soft_of(const LightGuess& guess);

}  // namespace darm::renderer
