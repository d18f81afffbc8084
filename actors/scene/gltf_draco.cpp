#include "actors/scene/gltf_draco.hpp"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <draco/compression/decode.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/metadata/metadata_decoder.h>
#pragma GCC diagnostic pop

#include <cstring>

#include "actors/scene/gltf_accessor.hpp"

namespace darm::scene::gltf {
namespace {

// Real streams need about a byte per face; a flat regular grid gets down to a tenth. More than this is an attack on
// memory.
constexpr std::uint64_t kMaxFacesPerByte = 64;
// What the decoder itself takes per face and point (corner table, attributes, maps), generously.
constexpr std::uint64_t kDecoderBytesPerElement = 64;

constexpr std::uint16_t kMetadataFlag = 0x8000;
constexpr std::uint8_t kSequential = 0;
constexpr std::uint8_t kEdgebreaker = 1;

struct DeclaredSize {
  std::uint32_t faces = 0;
  std::uint32_t points = 0;
};

/// Reads the counts at the head of a triangular mesh stream (Draco bitstream specification 2.2, sections 3 and 4).
Result<DeclaredSize> peek_size(Bytes bytes) {
  constexpr std::size_t kHeaderBytes = 11;
  if (bytes.size() < kHeaderBytes || std::memcmp(bytes.data(), "DRACO", 5) != 0)
    return fail("Draco data has no header");
  const auto version = static_cast<std::uint16_t>((bytes[5] << 8) | bytes[6]);
  if (version != 0x0202)
    return fail("Draco bitstream " + std::to_string(bytes[5]) + "." + std::to_string(bytes[6]) +
                " is not supported, only 2.2");
  if (bytes[7] != 1) return fail("Draco data is not a triangle mesh");
  const std::uint8_t method = bytes[8];
  const auto flags = static_cast<std::uint16_t>(bytes[9] | (bytes[10] << 8));
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()) + kHeaderBytes, bytes.size() - kHeaderBytes);
  buffer.set_bitstream_version(version);
  if (flags & kMetadataFlag) {
    draco::GeometryMetadata metadata;
    draco::MetadataDecoder decoder;
    if (!decoder.DecodeGeometryMetadata(&buffer, &metadata)) return fail("Draco metadata is damaged");
  }
  DeclaredSize size;
  bool ok = false;
  if (method == kSequential) {
    ok = draco::DecodeVarint(&size.faces, &buffer) && draco::DecodeVarint(&size.points, &buffer);
  } else if (method == kEdgebreaker) {
    std::uint8_t traversal = 0;
    ok = buffer.Decode(&traversal) && draco::DecodeVarint(&size.points, &buffer) &&
         draco::DecodeVarint(&size.faces, &buffer);
  }
  if (!ok) return fail("Draco data is damaged");
  return size;
}

/// Values of one attribute for every point, normalized as its accessor says.
Result<FloatArray> read_attribute(Document& document, const draco::Mesh& mesh, const draco::PointAttribute& attribute,
                                  const tinygltf::Accessor& accessor) {
  const int components = attribute.num_components();
  if (components < 1 || components > 4)
    return fail("Draco attribute has " + std::to_string(components) + " components");
  FloatArray out{mesh.num_points(), components, {}};
  const std::uint64_t values = static_cast<std::uint64_t>(mesh.num_points()) * static_cast<std::uint64_t>(components);
  if (auto ok = document.reserve(values * sizeof(float), "Draco attribute"); !ok) return std::unexpected(ok.error());
  out.values.resize(values);
  const bool scale = accessor.normalized && !attribute.normalized();
  const float factor = scale ? 1.0f / normalized_one(accessor.componentType) : 1.0f;
  for (draco::PointIndex i(0); i < mesh.num_points(); ++i) {
    float value[4] = {0, 0, 0, 0};
    const auto index = attribute.mapped_index(i);
    if (index.value() >= attribute.size() ||
        !attribute.ConvertValue<float>(index, static_cast<std::int8_t>(components), value))
      return fail("Draco attribute is damaged");
    float* to = out.values.data() + static_cast<std::size_t>(i.value()) * static_cast<std::size_t>(components);
    for (int c = 0; c < components; ++c) to[c] = value[c] * factor;
  }
  return out;
}

template <class Vector>
std::vector<Vector> as_vectors(const FloatArray& array, float missing) {
  std::vector<Vector> out(array.count);
  for (std::size_t i = 0; i < array.count; ++i)
    for (int c = 0; c < Vector::length(); ++c) out[i][c] = c < array.components ? array.at(i)[c] : missing;
  return out;
}

void store(PrimitiveData& data, const std::string& name, const FloatArray& array) {
  if (name == "POSITION") data.positions = as_vectors<glm::vec3>(array, 0.0f);
  if (name == "NORMAL") data.normals = as_vectors<glm::vec3>(array, 0.0f);
  if (name == "TANGENT") data.tangents = as_vectors<glm::vec4>(array, 1.0f);
  if (name == "TEXCOORD_0") data.uvs[0] = as_vectors<glm::vec2>(array, 0.0f);
  if (name == "TEXCOORD_1") data.uvs[1] = as_vectors<glm::vec2>(array, 0.0f);
  if (name == "COLOR_0") data.colors = as_vectors<glm::vec4>(array, 1.0f);
}

Result<std::unique_ptr<draco::Mesh>> decode_mesh(Document& document, Bytes bytes) {
  const auto size = peek_size(bytes);
  if (!size) return std::unexpected(size.error());
  const std::uint64_t elements = static_cast<std::uint64_t>(size->faces) + size->points;
  if (size->faces > document.limits.max_triangles || elements > kMaxFacesPerByte * bytes.size())
    return fail("Draco data declares " + std::to_string(size->faces) + " faces in " + std::to_string(bytes.size()) +
                " bytes");
  if (auto ok = document.reserve(elements * kDecoderBytesPerElement, "Draco data"); !ok)
    return std::unexpected(ok.error());
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) return fail("Draco data is damaged: " + decoded.status().error_msg_string());
  return std::move(decoded).value();
}

}  // namespace

Result<PrimitiveData> decode_draco(Document& document, const tinygltf::Primitive& primitive,
                                   const tinygltf::Value& extension) {
  const auto bytes = document.view(integer_or(extension, "bufferView", -1));
  if (!bytes) return std::unexpected(bytes.error().within("Draco data"));
  const auto mesh = decode_mesh(document, *bytes);
  if (!mesh) return std::unexpected(mesh.error());
  PrimitiveData data;
  if (!extension.Has("attributes") || !extension.Get("attributes").IsObject())
    return fail("Draco data without attributes");
  const tinygltf::Value& attributes = extension.Get("attributes");
  for (const std::string& name : attributes.Keys()) {
    const auto accessor = primitive.attributes.find(name);
    const auto* attribute =
        (*mesh)->GetAttributeByUniqueId(static_cast<std::uint32_t>(integer_or(attributes, name.c_str(), -1)));
    if (!attribute || accessor == primitive.attributes.end() || accessor->second < 0 ||
        static_cast<std::size_t>(accessor->second) >= document.model.accessors.size())
      return fail("Draco data lacks the attribute " + name.substr(0, 40));
    const auto values = read_attribute(document, **mesh, *attribute,
                                       document.model.accessors[static_cast<std::size_t>(accessor->second)]);
    if (!values) return std::unexpected(values.error());
    store(data, name, *values);
  }
  data.triangles.reserve((*mesh)->num_faces());
  for (draco::FaceIndex f(0); f < (*mesh)->num_faces(); ++f) {
    const auto& face = (*mesh)->face(f);
    data.triangles.emplace_back(face[0].value(), face[1].value(), face[2].value());
  }
  return data;
}

}  // namespace darm::scene::gltf
