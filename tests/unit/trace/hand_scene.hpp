// Small scenes built by hand, for tests that need exact geometry.
#pragma once

#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "actors/renderer/trace/ray_scene.hpp"
#include "actors/scene/scene.hpp"

namespace darm::test {

/// Collects quads and lights into a Scene.
class HandScene {
 public:
  scene::Scene scene;

  std::uint32_t material(const scene::Material& m) {
    scene.materials.push_back(m);
    return static_cast<std::uint32_t>(scene.materials.size() - 1);
  }

  /// A matte dielectric with albedo `rgb` that has no specular layer (ior 1).
  static scene::Material matte(glm::vec3 rgb, glm::vec3 emissive = glm::vec3(0.0f)) {
    scene::Material m;
    m.base_color = glm::vec4(rgb, 1.0f);
    m.metallic = 0;
    m.roughness = 1;
    m.ior = 1;
    m.emissive = emissive;
    return m;
  }

  /// Quad a, a+e1, a+e1+e2, a+e2 whose front looks along cross(e1, e2); returns its instance.
  std::uint32_t quad(glm::vec3 a, glm::vec3 e1, glm::vec3 e2, std::uint32_t material_index) {
    scene::Mesh mesh;
    const glm::vec3 n = glm::normalize(glm::cross(e1, e2));
    mesh.positions = {a, a + e1, a + e1 + e2, a + e2};
    mesh.normals.assign(4, n);
    mesh.uvs[0] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.material = material_index;
    return place(mesh);
  }

  std::uint32_t place(const scene::Mesh& mesh, const glm::mat4& to_world = glm::mat4(1.0f)) {
    scene.meshes.push_back(mesh);
    scene::Instance instance;
    instance.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
    instance.to_world = to_world;
    instance.flipped = glm::determinant(to_world) < 0;
    scene.instances.push_back(instance);
    return static_cast<std::uint32_t>(scene.instances.size() - 1);
  }

  /// Axis-aligned box from `low` to `high` whose fronts look inwards (`inwards`) or outwards.
  void box(glm::vec3 low, glm::vec3 high, std::uint32_t material_index, bool inwards) {
    const glm::vec3 d = high - low;
    const glm::vec3 x(d.x, 0, 0), y(0, d.y, 0), z(0, 0, d.z);
    const auto face = [&](glm::vec3 a, glm::vec3 e1, glm::vec3 e2) {
      inwards ? quad(a, e2, e1, material_index) : quad(a, e1, e2, material_index);
    };
    face(low, y, x);
    face(low, x, z);
    face(low, z, y);
    face(low + z, x, y);
    face(low + y, z, x);
    face(low + x, y, z);
  }

  [[nodiscard]] std::shared_ptr<const scene::Scene> share() const {
    auto copy = std::make_shared<scene::Scene>(scene);
    copy->bounds_min = glm::vec3(1e30f);
    copy->bounds_max = glm::vec3(-1e30f);
    for (const auto& i : copy->instances)
      for (const auto& p : copy->meshes[i.mesh].positions) {
        copy->bounds_min = glm::min(copy->bounds_min, glm::vec3(i.to_world * glm::vec4(p, 1)));
        copy->bounds_max = glm::max(copy->bounds_max, glm::vec3(i.to_world * glm::vec4(p, 1)));
      }
    return copy;
  }

  [[nodiscard]] std::shared_ptr<const renderer::trace::RayScene> rays() const {
    return renderer::trace::RayScene::build(share(), 1).value();
  }
};

}  // namespace darm::test
