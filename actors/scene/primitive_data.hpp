// A triangle primitive between file and Mesh: as read, before cleaning. Private to the loader; knows no glTF library.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <map>
#include <string>
#include <vector>

#include "actors/scene/scene.hpp"

namespace darm::scene {

/// Attribute arrays are empty or as long as `positions`; every index is below positions.size().
struct PrimitiveData {
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;
  std::vector<glm::vec4> tangents;
  std::array<std::vector<glm::vec2>, 2> uvs;
  std::vector<glm::vec4> colors;
  std::vector<glm::uvec3> triangles;
};

/// Drops what cannot be rendered (reasons are counted in `dropped`), makes unit normals and, where `tangent_uv_set`
/// names a UV set (-1: no normal map), tangents. The result keeps Mesh's promises; it may have no triangles.
Mesh make_mesh(PrimitiveData data, int tangent_uv_set, std::map<std::string, std::uint64_t>& dropped);

}  // namespace darm::scene
