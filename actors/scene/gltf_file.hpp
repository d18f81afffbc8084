// The bytes of a glTF scene: the file itself, its GLB chunks, and what its URIs refer to. Private to the loader.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "actors/scene/gltf_loader.hpp"

namespace darm::scene::gltf {

using Bytes = std::span<const std::uint8_t>;

/// Reads files under a common byte limit and keeps them for as long as it lives. Spans handed out stay valid so long.
class GltfFile {
 public:
  /// Reads `path` and splits it into JSON and, for a GLB, the binary chunk. Errors do not name the file: the caller
  /// does.
  static Result<GltfFile> open(const std::filesystem::path& path, const LoadLimits& limits);
  /// The same from memory that must outlive the result; every URI but `data:` is refused.
  static Result<GltfFile> view(Bytes bytes, const LoadLimits& limits);

  [[nodiscard]] std::string_view json() const { return json_; }
  [[nodiscard]] const std::optional<Bytes>& binary_chunk() const { return binary_chunk_; }

  /// The bytes behind a URI: `data:` (base64 or percent-encoded) or a regular file in the scene's own folder or below.
  /// Absolute paths, "..", links that lead out of the folder and network addresses are refused.
  Result<Bytes> resolve(const std::string& uri);

  /// XXH3 over everything read so far.
  [[nodiscard]] std::uint64_t hash() const { return hash_; }

 private:
  Result<Bytes> read(const std::filesystem::path& path);
  Result<Bytes> decode_data_uri(std::string_view uri);
  Result<void> split(Bytes bytes);
  Bytes keep(std::vector<std::uint8_t> bytes);

  std::optional<std::filesystem::path> folder_;  ///< canonical; none for a file in memory
  std::uint64_t max_bytes_ = 0;
  std::uint64_t used_bytes_ = 0;
  std::uint64_t hash_ = 0;
  std::deque<std::vector<std::uint8_t>> storage_;
  std::string_view json_;
  std::optional<Bytes> binary_chunk_;
};

}  // namespace darm::scene::gltf
