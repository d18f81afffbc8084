// A parsed glTF document: tinygltf's typed model, plus the bytes of its buffers and images, which we fetch ourselves so
// that every limit is checked before memory is taken. Private to the loader.
#pragma once

#include <tiny_gltf.h>

#include <map>
#include <string>
#include <vector>

#include "actors/scene/gltf_file.hpp"

namespace darm::scene::gltf {

/// Where an image's encoded bytes are.
struct ImageSource {
  std::string name;
  std::string uri;  ///< empty: in a buffer view
  int buffer_view = -1;
  bool fetched = false;
  Bytes bytes;
};

struct Document {
  GltfFile file;
  LoadLimits limits;
  tinygltf::Model model;
  std::vector<Bytes> buffers;  ///< buffers without bytes (meshopt fallbacks) are empty
  std::vector<ImageSource> images;
  std::vector<Bytes> buffer_views;  ///< decoded where they were meshopt-compressed
  std::vector<std::vector<std::uint8_t>> decoded_views;
  std::uint64_t decoded_bytes = 0;  ///< taken so far of limits.max_decoded_bytes
  std::vector<std::string> warnings;
  std::map<std::string, std::uint64_t> dropped;  ///< reason -> triangles

  /// Reserves memory for decoded data, before it is taken. `what` names it in the error.
  Result<void> reserve(std::uint64_t bytes, const std::string& what);
  /// Bytes of a buffer view after decompression; error if it does not exist.
  Result<Bytes> view(int index) const;
};

/// Parses JSON and fetches buffers. Checks version, required extensions, sizes and nesting. Errors do not name the
/// file.
Result<Document> parse_document(GltfFile file, const LoadLimits& limits);

/// "mesh 3 'column'": how a thing of the file is called in messages.
std::string named(const char* kind, std::size_t index, const std::string& name);

/// A member of an extension object, or `fallback` when it is absent or of another type. Never throws.
double number_or(const tinygltf::Value& object, const char* key, double fallback);
int integer_or(const tinygltf::Value& object, const char* key, int fallback);
const tinygltf::Value* find_extension(const tinygltf::ExtensionMap& extensions, const char* name);

}  // namespace darm::scene::gltf
