// The node hierarchy, flattened: who stands where, in file coordinates and double precision. Private to the loader.
#pragma once

#include <glm/mat4x4.hpp>

#include "actors/scene/gltf_document.hpp"

namespace darm::scene::gltf {

/// A node of the scene with its world transform.
struct PlacedNode {
  std::size_t node = 0;
  glm::dmat4 to_world{1.0};
};

/// Nodes of the file's scene in depth-first order. Iterative; a node reached twice (a cycle, or two parents), a depth
/// or number over the limits, or a missing scene is an error.
Result<std::vector<PlacedNode>> place_nodes(const Document& document);

/// Transforms of the instances of a node with EXT_mesh_gpu_instancing, relative to the node; one identity without it.
Result<std::vector<glm::dmat4>> read_instancing(Document& document, const tinygltf::Node& node);

/// Light of a node in file coordinates (Light::object is left 0), if it carries one. Its intensity is brought into
/// 0..1e12.
struct PlacedLight {
  Light light;
  glm::dvec3 position{0.0};
};
Result<std::optional<PlacedLight>> read_light(const Document& document, const PlacedNode& placed);

/// Warns of lights whose intensity read_light() changes: below 0, not finite, too large.
void warn_of_lights(Document& document);

/// Perspective camera of a node, if it carries one.
std::optional<NamedCamera> read_camera(Document& document, const PlacedNode& placed);

/// extras.darm_dynamic: true, or a number but 0.
bool is_dynamic(const tinygltf::Node& node);

}  // namespace darm::scene::gltf
