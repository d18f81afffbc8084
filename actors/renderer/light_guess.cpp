#include "actors/renderer/light_guess.hpp"

#include <algorithm>

#include "actors/renderer/sampling.hpp"

namespace darm::renderer {

namespace {

constexpr float kSpread = 1.5f;
constexpr float kRelativeError = 0.2f;
constexpr float kTexels = 64;  // a coarse texel is many fine ones, off alike

}  // namespace

LayerLight from_guess(const glm::vec3& mean, float spread) {
  const float error = kRelativeError * luminance(mean);
  return {mean, kSpread * std::max(spread, 0.0f) + error * error, kTexels};
}

}  // namespace darm::renderer
