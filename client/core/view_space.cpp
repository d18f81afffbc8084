#include "client/core/view_space.hpp"

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

namespace darm::client {

glm::dmat4 world_to_clip(const SceneModel& scene, const View& view, bool reversed) {
  const double diagonal = std::max(1e-3, glm::length(glm::dvec3(scene.high()) - glm::dvec3(scene.low())));
  const glm::dvec3 eye = view.position - scene.origin();
  const glm::dvec3 farthest =
      glm::max(glm::abs(eye - glm::dvec3(scene.low())), glm::abs(eye - glm::dvec3(scene.high())));
  const double near_plane = reversed ? diagonal * 1e-5 : diagonal / 5000;
  const double far_plane = std::max(near_plane * 2, glm::length(farthest) * 1.01);
  return projection_matrix(view, near_plane, far_plane, reversed) * view_matrix(view, scene.origin());
}

glm::vec3 centre(const Chunk& chunk, const InstanceShape& instance) {
  return glm::vec3(instance.to_world * glm::vec4((chunk.low + chunk.high) * 0.5f, 1.0f));
}

bool outside(const Chunk& chunk, const glm::dmat4& to_clip) {
  std::array<int, 5> out{};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec4 p =
        to_clip * glm::dvec4((corner & 1) ? chunk.high.x : chunk.low.x, (corner & 2) ? chunk.high.y : chunk.low.y,
                             (corner & 4) ? chunk.high.z : chunk.low.z, 1.0);
    out[0] += p.x < -p.w;
    out[1] += p.x > p.w;
    out[2] += p.y < -p.w;
    out[3] += p.y > p.w;
    out[4] += p.w < 0;
  }
  return std::any_of(out.begin(), out.end(), [](int n) { return n == 8; });
}

}  // namespace darm::client
