#include "actors/renderer/integrator.hpp"

#include <algorithm>

namespace darm::renderer {

const CompiledIntegrator& smallest_cover(const Effects& needed) {
  const auto covers = [&](const CompiledIntegrator& c) { return c.effects.cover(needed); };
  const auto plain = plain_integrators();
  if (const auto it = std::ranges::find_if(plain, covers); it != plain.end()) return *it;
  const auto textured = textured_integrators();
  const auto it = std::ranges::find_if(textured, covers);
  return it != textured.end() ? *it : textured.back();
}

}  // namespace darm::renderer
