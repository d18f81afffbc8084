// Scenes built by hand for the atlas tests.
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <glm/geometric.hpp>
#include <memory>
#include <random>
#include <vector>

#include "actors/scene/scene.hpp"

namespace darm::atlas::testing {

inline scene::Scene scene_of(std::vector<scene::Mesh> meshes, bool double_sided = false) {
  scene::Scene s;
  s.path = "hand-made";
  s.materials.resize(1);
  s.materials[0].double_sided = double_sided;
  s.bounds_min = glm::vec3(1e9f);
  s.bounds_max = glm::vec3(-1e9f);
  for (auto& m : meshes) {
    for (const auto& p : m.positions) {
      for (int a = 0; a < 3; ++a) {
        s.bounds_min[a] = std::min(s.bounds_min[a], p[a]);
        s.bounds_max[a] = std::max(s.bounds_max[a], p[a]);
      }
    }
    s.instances.push_back({.mesh = static_cast<std::uint32_t>(s.meshes.size())});
    s.meshes.push_back(std::move(m));
  }
  return s;
}

/// A sheet of nu x nv quads from at(u, v), u and v in [0, 1].
template <class At>
scene::Mesh sheet(int nu, int nv, const At& at) {
  scene::Mesh m;
  for (int j = 0; j <= nv; ++j)
    for (int i = 0; i <= nu; ++i)
      m.positions.push_back(
          at(static_cast<float>(i) / static_cast<float>(nu), static_cast<float>(j) / static_cast<float>(nv)));
  const auto id = [&](int i, int j) { return static_cast<std::uint32_t>(j * (nu + 1) + i); };
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      m.triangles.emplace_back(id(i, j), id(i + 1, j), id(i + 1, j + 1));
      m.triangles.emplace_back(id(i, j), id(i + 1, j + 1), id(i, j + 1));
    }
  return m;
}

inline scene::Mesh box(glm::vec3 low, glm::vec3 high) {
  scene::Mesh m;
  for (int i = 0; i < 8; ++i)
    m.positions.emplace_back(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z);
  for (const auto& q : {glm::uvec4(0, 2, 3, 1), glm::uvec4(4, 5, 7, 6), glm::uvec4(0, 1, 5, 4), glm::uvec4(2, 6, 7, 3),
                        glm::uvec4(0, 4, 6, 2), glm::uvec4(1, 3, 7, 5)}) {
    m.triangles.emplace_back(q.x, q.y, q.z);
    m.triangles.emplace_back(q.x, q.z, q.w);
  }
  return m;
}

inline scene::Mesh sphere(float radius, int n) {
  return sheet(2 * n, n, [&](float u, float v) {
    const float a = 6.2831853f * (u < 1 ? u : 0.0f), b = 3.14159265f * v;
    return radius *
           glm::vec3(std::sin(b) * std::cos(a),
                     v > 0 && v < 1 ? std::cos(b)
                     : v > 0        ? -1.0f
                                    : 1.0f,
                     v > 0 && v < 1 ? std::sin(b) * std::sin(a) : 0.0f) *
           glm::vec3(v > 0 && v < 1, 1, 1);
  });
}

inline scene::Mesh annulus(float inner, float outer, int n) {
  return sheet(n, 3, [&](float u, float v) {
    const float a = 6.2831853f * (u < 1 ? u : 0.0f), r = inner + (outer - inner) * v;
    return glm::vec3(r * std::cos(a), 0, r * std::sin(a));
  });
}

/// A spiral stair without steps: several turns over one another, all looking up.
inline scene::Mesh helix(int turns, float rise) {
  return sheet(turns * 32, 2, [&](float u, float v) {
    const float a = 6.2831853f * static_cast<float>(turns) * u, r = 1 + v;
    return glm::vec3(r * std::cos(a), rise * a, -r * std::sin(a));
  });
}

inline scene::Mesh triangle_soup(std::uint32_t seed, int n) {
  std::mt19937 random(seed);
  const auto roll = [&](float lo, float hi) {
    return lo + (hi - lo) * static_cast<float>(random() >> 8) / 16777216.0f;
  };
  scene::Mesh m;
  for (int i = 0; i < n; ++i) {
    const glm::vec3 at(roll(-5, 5), roll(-5, 5), roll(-5, 5));
    const float size = std::exp(roll(-5, 1));
    for (int c = 0; c < 3; ++c) m.positions.push_back(at + size * glm::vec3(roll(-1, 1), roll(-1, 1), roll(-1, 1)));
    const auto v = static_cast<std::uint32_t>(m.positions.size());
    m.triangles.emplace_back(v - 3, v - 2, v - 1);
  }
  return m;
}

}  // namespace darm::atlas::testing
