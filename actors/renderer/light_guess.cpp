#include "actors/renderer/light_guess.hpp"

#include <algorithm>

#include "actors/renderer/sampling.hpp"

namespace darm::renderer {

namespace {

constexpr float kSpread = 1.0f;
constexpr float kRelativeSquare = 0.04f;
constexpr float kAround = 1.2f;
constexpr float kLeastSquare = 0.0005f;
constexpr float kLoneSquare = 0.7f;
constexpr float kTexels = 64;  // a coarse texel is many fine ones, off alike

LayerLight layer_of(const LightGuess& guess, const glm::vec3& mean, float spread, float around) {
  const float square = luminance(mean) * luminance(mean);
  if (guess.lone) return {mean, kLoneSquare * square, 1};
  const float near = kSpread * std::max(spread, 0.0f) + kRelativeSquare * square;
  if (!guess.surrounded) return {mean, near, kTexels};
  return {mean, std::min(near, kAround * std::max(around, 0.0f) + kLeastSquare * square), kTexels};
}

}  // namespace

LayerLight sharp_of(const LightGuess& guess) {
  return layer_of(guess, guess.sharp, guess.sharp_spread, guess.sharp_around);
}

LayerLight soft_of(const LightGuess& guess) {
  LayerLight layer = layer_of(guess, guess.soft, guess.soft_spread, guess.soft_around);
  if (!guess.lone) layer.variance += std::max(guess.soft_noise, 0.0f);
  return layer;
}

}  // namespace darm::renderer
