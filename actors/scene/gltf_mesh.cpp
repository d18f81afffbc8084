#include "actors/scene/gltf_mesh.hpp"

#include <algorithm>

#include "actors/scene/gltf_accessor.hpp"
#include "actors/scene/gltf_draco.hpp"

namespace darm::scene::gltf {
namespace {

template <class Vector>
Result<void> read_attribute(Document& document, const tinygltf::Primitive& primitive, const char* name,
                            int min_components, std::vector<Vector>& out) {
  const auto it = primitive.attributes.find(name);
  if (it == primitive.attributes.end() || !out.empty()) return {};
  const auto array = read_floats(document, it->second, min_components, Vector::length());
  if (!array) return std::unexpected(array.error().within(name));
  out.resize(array->count);
  for (std::size_t i = 0; i < array->count; ++i)
    for (int c = 0; c < Vector::length(); ++c) out[i][c] = c < array->components ? array->at(i)[c] : 1.0f;
  return {};
}

Result<void> read_attributes(Document& document, const tinygltf::Primitive& primitive, PrimitiveData& data) {
  if (auto ok = read_attribute(document, primitive, "POSITION", 3, data.positions); !ok) return ok;
  if (data.positions.empty()) return fail("has no POSITION");
  if (auto ok = read_attribute(document, primitive, "NORMAL", 3, data.normals); !ok) return ok;
  if (auto ok = read_attribute(document, primitive, "TANGENT", 4, data.tangents); !ok) return ok;
  if (auto ok = read_attribute(document, primitive, "TEXCOORD_0", 2, data.uvs[0]); !ok) return ok;
  if (auto ok = read_attribute(document, primitive, "TEXCOORD_1", 2, data.uvs[1]); !ok) return ok;
  return read_attribute(document, primitive, "COLOR_0", 3, data.colors);
}

Result<void> check_attribute_counts(const PrimitiveData& data) {
  const std::size_t vertices = data.positions.size();
  const auto differs = [&](std::size_t count) { return count != 0 && count != vertices; };
  if (differs(data.normals.size()) || differs(data.tangents.size()) || differs(data.uvs[0].size()) ||
      differs(data.uvs[1].size()) || differs(data.colors.size()))
    return fail("has attributes of different lengths");
  return {};
}

/// Corner indices of triangle `i` of a list, strip or fan (glTF 2.0, section 3.7.2.1).
glm::uvec3 corners(int mode, std::uint32_t i) {
  if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) return {i, i + 1 + i % 2, i + 2 - i % 2};
  if (mode == TINYGLTF_MODE_TRIANGLE_FAN) return {i + 1, i + 2, 0};
  return {3 * i, 3 * i + 1, 3 * i + 2};
}

Result<void> read_triangles(Document& document, const tinygltf::Primitive& primitive, PrimitiveData& data) {
  std::vector<std::uint32_t> indices;
  if (primitive.indices >= 0) {
    auto read = read_indices(document, primitive.indices);
    if (!read) return std::unexpected(read.error());
    indices = std::move(*read);
  }
  const std::size_t count = primitive.indices >= 0 ? indices.size() : data.positions.size();
  const bool list = primitive.mode == TINYGLTF_MODE_TRIANGLES;
  if (count < 3 || (list && count % 3 != 0))
    return fail("has " + std::to_string(count) + " indices, which make no whole triangles");
  const std::size_t triangles = list ? count / 3 : count - 2;
  if (triangles > document.limits.max_triangles || data.positions.size() > 0xfffffff0u)
    return fail("has " + std::to_string(triangles) + " triangles, over the limit of " +
                std::to_string(document.limits.max_triangles));
  if (auto ok = document.reserve(triangles * sizeof(glm::uvec3), "its triangles"); !ok) return ok;
  data.triangles.reserve(triangles);
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const glm::uvec3 c = corners(primitive.mode, i);
    data.triangles.push_back(indices.empty() ? c : glm::uvec3(indices[c.x], indices[c.y], indices[c.z]));
  }
  return {};
}

Result<void> check_indices(const PrimitiveData& data) {
  const std::size_t vertices = data.positions.size();
  for (const glm::uvec3& t : data.triangles) {
    const std::uint32_t largest = std::max({t.x, t.y, t.z});
    if (largest >= vertices)
      return fail("index " + std::to_string(largest) + " points past its " + std::to_string(vertices) + " vertices");
  }
  return {};
}

}  // namespace

Result<PrimitiveData> read_primitive(Document& document, const tinygltf::Primitive& primitive) {
  PrimitiveData data;
  const bool surface = primitive.mode == TINYGLTF_MODE_TRIANGLES || primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP ||
                       primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN;
  if (!surface) return data;
  const auto* draco = find_extension(primitive.extensions, "KHR_draco_mesh_compression");
  if (draco) {
    auto decoded = decode_draco(document, primitive, *draco);
    if (!decoded) return std::unexpected(decoded.error());
    data = std::move(*decoded);
  }
  // Attributes that Draco did not hold are ordinary accessors.
  if (auto ok = read_attributes(document, primitive, data); !ok) return std::unexpected(ok.error());
  if (auto ok = check_attribute_counts(data); !ok) return std::unexpected(ok.error());
  if (!draco)
    if (auto ok = read_triangles(document, primitive, data); !ok) return std::unexpected(ok.error());
  if (auto ok = check_indices(data); !ok) return std::unexpected(ok.error());
  return data;
}

}  // namespace darm::scene::gltf
