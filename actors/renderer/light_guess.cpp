#include "actors/renderer/light_guess.hpp"

#include <algorithm>

#include "actors/renderer/sampling.hpp"

namespace darm::renderer {

namespace {

constexpr float kSpread = 1.5f;
constexpr float kRelativeError = 0.2f;

}  // namespace

LayerLight from_guess(const glm::vec3& mean, float spread) {
  const float error = kRelativeError * luminance(mean);
  return {mean, kSpread * std::max(spread, 0.0f) + error * error};
}

}  // namespace darm::renderer
