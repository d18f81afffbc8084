#include "client/desktop/pick.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>
#include <limits>

namespace darm::client::desktop {
namespace {

struct Ray {
  glm::dvec3 origin, direction;
};

// Distance at which the ray enters the box; infinite: it misses.
double entry(const Ray& ray, const glm::dvec3& low, const glm::dvec3& high) {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double a = (low[i] - ray.origin[i]) / ray.direction[i], b = (high[i] - ray.origin[i]) / ray.direction[i];
    if (std::isnan(a) || std::isnan(b)) continue;  // parallel and on the plane
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave ? enter : std::numeric_limits<double>::infinity();
}

glm::dvec3 place(const Vertex& v) { return {v.position[0], v.position[1], v.position[2]}; }

// Moeller and Trumbore, "Fast, Minimum Storage Ray-Triangle Intersection" (1997).
double nearest_triangle(const Chunk& chunk, const Ray& ray, double nearest) {
  for (std::size_t i = 0; i + 2 < chunk.indices.size(); i += 3) {
    const glm::dvec3 a = place(chunk.vertices[chunk.indices[i]]);
    const glm::dvec3 e1 = place(chunk.vertices[chunk.indices[i + 1]]) - a;
    const glm::dvec3 e2 = place(chunk.vertices[chunk.indices[i + 2]]) - a;
    const glm::dvec3 p = glm::cross(ray.direction, e2);
    const double determinant = glm::dot(e1, p);
    if (determinant == 0) continue;
    const glm::dvec3 t = ray.origin - a;
    const double u = glm::dot(t, p) / determinant;
    if (!(u >= 0 && u <= 1)) continue;
    const glm::dvec3 q = glm::cross(t, e1);
    const double v = glm::dot(ray.direction, q) / determinant;
    if (!(v >= 0 && u + v <= 1)) continue;
    const double distance = glm::dot(e2, q) / determinant;
    if (distance > 0 && distance < nearest) nearest = distance;
  }
  return nearest;
}

}  // namespace

std::optional<double> pick(const SceneModel& scene, const glm::dvec3& origin, const glm::dvec3& direction) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const InstanceShape& instance : scene.instances()) {
    // The parameter along the ray is the same in node space, whatever the node's scale.
    const glm::dmat4 to_node = glm::inverse(glm::dmat4(instance.to_world));
    const Ray ray{glm::dvec3(to_node * glm::dvec4(origin, 1)), glm::dvec3(to_node * glm::dvec4(direction, 0))};
    for (const Chunk& chunk : scene.chunks()) {
      if (chunk.chart != instance.chart) continue;
      if (entry(ray, glm::dvec3(chunk.low), glm::dvec3(chunk.high)) >= nearest) continue;
      nearest = nearest_triangle(chunk, ray, nearest);
    }
  }
  return std::isfinite(nearest) ? std::optional(nearest) : std::nullopt;
}

std::optional<glm::dvec3> point_under(const SceneModel& scene, const UprightView& view, double x, double y) {
  const double height = 2 * std::tan(view.fovy / 2);
  const glm::dvec3 ray = glm::normalize(forward(view) + right(view) * (x * height) + up(view) * (y * height));
  const auto distance = pick(scene, view.position - scene.origin(), ray);
  if (!distance) return std::nullopt;
  return view.position + ray * *distance;
}

}  // namespace darm::client::desktop
