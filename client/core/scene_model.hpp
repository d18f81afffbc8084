// What the client knows of the scene: manifest and geometry chunks, decoded and checked. Pure; no GL, no sockets.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "client/core/result.hpp"
#include "proto/darm.pb.h"
#include "proto/limits.hpp"

namespace darm::client {

inline constexpr std::uint32_t kTileSize = 30;      ///< payload of a tile, texels per side
inline constexpr std::uint32_t kSlotSize = 32;      ///< payload plus a border of one texel
inline constexpr std::uint32_t kTableWidth = 2048;  ///< width of every table texture
static_assert(proto::kMaxTableEntries == kTableWidth * 2048u);
inline constexpr std::uint32_t kMaxLevels = 16;
inline constexpr std::uint32_t kNoBase = 0xffffffffu;

/// Bounds on what a server may announce; checked before memory is taken.
struct SceneLimits {
  std::uint32_t max_instances = proto::kMaxInstances;
  std::uint32_t max_chunks = proto::kMaxGeometryChunks;
  std::uint32_t max_chunk_vertices = proto::kMaxChunkVertices;
  std::uint32_t max_chunk_indices = proto::kMaxChunkIndices;
  std::uint64_t max_geometry_bytes = 8ull << 30;  ///< vertices and indices of all chunks together
};

struct LevelShape {
  float density = 0;  ///< texels per world unit
  std::uint32_t width = 0, height = 0, tiles_x = 0, tiles_y = 0;
  std::uint32_t first_tile = 0;  ///< place of this level's tile 0 in the linear page table
};

struct PatchPlace {
  std::uint32_t x = 0, y = 0;
  float scale = 1;
};

enum class AlphaMode : std::uint8_t { kOpaque, kMask, kBlend };

struct InstanceShape {
  std::uint32_t chart = 0;
  glm::mat4 to_world{1.0f};
  std::uint32_t front_base = 0;
  std::uint32_t back_base = kNoBase;
  bool flipped = false;
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  float alpha_cutoff = 0.5f;
  float transmission = 0;
  glm::vec3 tint{1.0f};  ///< linear
  float f0 = 0;          ///< > 0: with the private layer, what is not reflected is dimmed by 1 - Fresnel
  bool camera_sees_back = true;
};

/// One vertex as it lies in the decoded chunk and in the vertex buffer.
struct Vertex {
  std::array<float, 3> position;
  std::array<float, 2> uv;  ///< world units within the patch
  std::uint32_t local_patch;
};
static_assert(sizeof(Vertex) == 24);

struct Chunk {
  std::uint32_t chart = 0;
  std::uint32_t index = 0;
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
  glm::vec3 low{0.0f}, high{0.0f};  ///< box of the positions, node space
};

struct Background {
  glm::vec3 zenith{0.0f}, horizon{0.0f}, ground{0.0f};  ///< linear
  bool has_sun = false;
  glm::vec3 sun_direction{0, 1, 0};  ///< to the disc, unit
  float sun_cos = 1;
  glm::vec3 sun_rgb{0.0f};  ///< linear, exposed
};

/// The scene as announced, and the geometry that has come so far. A refused chunk leaves the model as it was.
/// Where one thread reads and another draws, each has a copy of the announced scene: the one reads chunks, the other
/// keeps them.
class SceneModel {
 public:
  [[nodiscard]] static Result<SceneModel> from_manifest(const wire::SceneManifest& manifest,
                                                        const SceneLimits& limits = {});
  /// Checks and decodes a chunk, and notes that it came.
  [[nodiscard]] Result<Chunk> read_chunk(const wire::GeometryChunk& chunk);
  /// `chunk` was read by this model or by one of the same manifest.
  void keep_chunk(Chunk chunk);
  /// Both.
  [[nodiscard]] Result<void> add_chunk(const wire::GeometryChunk& chunk);

  [[nodiscard]] bool all_read() const { return chunks_read_ == expected_chunks_; }
  [[nodiscard]] bool complete() const { return chunks_.size() == expected_chunks_; }
  [[nodiscard]] const std::vector<Chunk>& chunks() const { return chunks_; }
  [[nodiscard]] const std::vector<LevelShape>& levels() const { return levels_; }
  [[nodiscard]] const std::vector<InstanceShape>& instances() const { return instances_; }
  /// Level-major: entry of patch p at level l is places()[l * patch_count() + p].
  [[nodiscard]] const std::vector<PatchPlace>& places() const { return places_; }
  [[nodiscard]] std::uint32_t patch_count() const { return patch_count_; }
  [[nodiscard]] std::uint32_t tile_count() const { return tile_count_; }  ///< over all levels
  [[nodiscard]] float q() const { return q_; }
  [[nodiscard]] const glm::dvec3& origin() const { return origin_; }
  [[nodiscard]] const glm::vec3& low() const { return low_; }
  [[nodiscard]] const glm::vec3& high() const { return high_; }
  [[nodiscard]] const Background& background() const { return background_; }
  [[nodiscard]] bool has_alpha() const { return has_alpha_; }
  /// Alpha of CoarseTex, a byte for each texel of the last level, row-major; empty: opaque.
  [[nodiscard]] const std::string& coarse_coverage() const { return coarse_coverage_; }
  [[nodiscard]] bool has_clear() const { return has_clear_; }  ///< some surface shows what is behind it, tinted
  [[nodiscard]] std::uint64_t scene_hash() const { return scene_hash_; }
  [[nodiscard]] std::uint64_t tag() const { return tag_; }  ///< equal for equal manifest and geometry; 0: none
  [[nodiscard]] std::uint64_t triangles() const { return triangles_; }  ///< of the chunks that have come
  /// Level of a tile's page-table entry is known from TileId: level << 28 | index. False if there is no such tile.
  [[nodiscard]] bool page_entry(std::uint32_t tile, std::uint32_t& entry) const;

 private:
  [[nodiscard]] Result<void> read_levels(const wire::SceneManifest& manifest);
  [[nodiscard]] Result<void> read_patches(const wire::SceneManifest& manifest);
  [[nodiscard]] Result<void> read_coarse_coverage(const wire::SceneManifest& manifest);
  [[nodiscard]] Result<void> read_instances(const wire::SceneManifest& manifest);
  [[nodiscard]] Result<void> read_surroundings(const wire::SceneManifest& manifest);

  SceneLimits limits_;
  std::vector<LevelShape> levels_;
  std::vector<PatchPlace> places_;
  std::vector<InstanceShape> instances_;
  std::vector<Chunk> chunks_;
  std::vector<bool> chunk_seen_;
  std::vector<std::uint32_t> highest_base_;  ///< per chart: largest base of an instance that uses it
  std::uint32_t patch_count_ = 0;
  std::uint32_t tile_count_ = 0;
  std::uint32_t expected_chunks_ = 0;
  std::uint32_t chunks_read_ = 0;
  std::uint64_t geometry_bytes_ = 0;
  std::uint64_t scene_hash_ = 0;
  std::uint64_t tag_ = 0;
  std::uint64_t triangles_ = 0;
  float q_ = 0;
  glm::dvec3 origin_{0.0};
  glm::vec3 low_{0.0f}, high_{0.0f};
  Background background_;
  std::string coarse_coverage_;
  bool has_alpha_ = false;
  bool has_clear_ = false;
};

[[nodiscard]] float srgb_to_linear(float encoded);
[[nodiscard]] float linear_to_srgb(float linear);

}  // namespace darm::client
