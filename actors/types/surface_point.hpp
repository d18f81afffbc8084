// A point on the scene's surface, named by triangle: exact under moving instances, free of world coordinates.
#pragma once

#include <cstdint>

namespace darm {

/// Point (1 - u - v, u, v) of a triangle of an instance (Scene::instances, Mesh::triangles), seen from `front` or back.
/// u, v >= 0 and u + v <= 1.
struct SurfacePoint {
  std::uint32_t instance = 0;
  std::uint32_t triangle = 0;
  float u = 0;
  float v = 0;
  bool front = true;
};

}  // namespace darm
