#include "actors/scene/gltf_meshopt.hpp"

#include <meshoptimizer.h>

namespace darm::scene::gltf {
namespace {

// The vertex codec spends at least 4 header bytes per 256 vertices and byte column, the index codecs at least one byte
// per triangle or index: nothing real decodes to more than 64 times its size.
constexpr std::uint64_t kMaxRatio = 128;

struct Compressed {
  Bytes source;
  std::size_t count = 0;
  std::size_t stride = 0;
  std::string mode;
  std::string filter;
};

Result<Bytes> slice(const Document& document, int buffer, double offset, double length) {
  if (buffer < 0 || static_cast<std::size_t>(buffer) >= document.buffers.size())
    return fail("names buffer " + std::to_string(buffer) + ", which does not exist");
  const Bytes bytes = document.buffers[static_cast<std::size_t>(buffer)];
  if (!(offset >= 0) || !(length >= 0) || offset + length > static_cast<double>(bytes.size()))
    return fail("reaches past the end of buffer " + std::to_string(buffer) + " (" + std::to_string(bytes.size()) +
                " bytes)");
  return bytes.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(length));
}

std::string text_or(const tinygltf::Value& object, const char* key, const char* fallback) {
  return object.Has(key) && object.Get(key).IsString() ? object.Get(key).Get<std::string>() : fallback;
}

Result<Compressed> read_extension(const Document& document, const tinygltf::Value& extension) {
  Compressed c;
  const auto source = slice(document, integer_or(extension, "buffer", -1), number_or(extension, "byteOffset", 0),
                            number_or(extension, "byteLength", -1));
  if (!source) return std::unexpected(source.error().within("meshopt data"));
  c.source = *source;
  const int count = integer_or(extension, "count", -1);
  const int stride = integer_or(extension, "byteStride", -1);
  if (count < 0 || stride < 1 || stride > 256) return fail("meshopt data with bad count or stride");
  c.count = static_cast<std::size_t>(count);
  c.stride = static_cast<std::size_t>(stride);
  c.mode = text_or(extension, "mode", "");
  c.filter = text_or(extension, "filter", "NONE");
  return c;
}

Result<void> decode(const Compressed& c, std::vector<std::uint8_t>& out) {
  int status = -1;
  if (c.mode == "ATTRIBUTES" && c.stride % 4 == 0) {
    status = meshopt_decodeVertexBuffer(out.data(), c.count, c.stride, c.source.data(), c.source.size());
  } else if (c.mode == "TRIANGLES" && (c.stride == 2 || c.stride == 4) && c.count % 3 == 0) {
    status = meshopt_decodeIndexBuffer(out.data(), c.count, c.stride, c.source.data(), c.source.size());
  } else if (c.mode == "INDICES" && (c.stride == 2 || c.stride == 4)) {
    status = meshopt_decodeIndexSequence(out.data(), c.count, c.stride, c.source.data(), c.source.size());
  } else {
    return fail("meshopt mode '" + c.mode + "' with stride " + std::to_string(c.stride) + " is not valid");
  }
  if (status != 0) return fail("meshopt data is damaged");
  if (c.filter == "NONE") return {};
  if (c.mode != "ATTRIBUTES") return fail("meshopt filter on indices");
  if (c.filter == "OCTAHEDRAL" && (c.stride == 4 || c.stride == 8)) {
    meshopt_decodeFilterOct(out.data(), c.count, c.stride);
  } else if (c.filter == "QUATERNION" && c.stride == 8) {
    meshopt_decodeFilterQuat(out.data(), c.count, c.stride);
  } else if (c.filter == "EXPONENTIAL") {
    meshopt_decodeFilterExp(out.data(), c.count, c.stride);
  } else {
    return fail("meshopt filter '" + c.filter + "' with stride " + std::to_string(c.stride) + " is not valid");
  }
  return {};
}

}  // namespace

Result<Bytes> decode_buffer_view(Document& document, std::size_t index) {
  const tinygltf::BufferView& view = document.model.bufferViews[index];
  const auto* extension = find_extension(view.extensions, "EXT_meshopt_compression");
  if (!extension)
    return slice(document, view.buffer, static_cast<double>(view.byteOffset), static_cast<double>(view.byteLength));
  const auto compressed = read_extension(document, *extension);
  if (!compressed) return std::unexpected(compressed.error());
  const std::uint64_t bytes = static_cast<std::uint64_t>(compressed->count) * compressed->stride;
  if (bytes > kMaxRatio * compressed->source.size() + 4096) return fail("meshopt data declares more than it can hold");
  if (const auto reserved = document.reserve(bytes, "meshopt data"); !reserved)
    return std::unexpected(reserved.error());
  // The vertex filters of meshoptimizer work on four elements at a time and stay inside count * stride.
  std::vector<std::uint8_t> out(bytes);
  if (const auto decoded = decode(*compressed, out); !decoded) return std::unexpected(decoded.error());
  document.decoded_views[index] = std::move(out);
  return Bytes(document.decoded_views[index]);
}

}  // namespace darm::scene::gltf
