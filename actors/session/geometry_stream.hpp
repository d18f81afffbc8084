// The scene as a client needs it: manifest and compressed geometry. Made once per scene, shared by all sessions.
#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/scene/scene.hpp"
#include "actors/session/bytes.hpp"
#include "actors/session/chart_geometry.hpp"
#include "actors/types/camera.hpp"
#include "actors/types/error.hpp"

namespace darm::session {

/// Immutable; thread-safe. All bytes are whole messages with their length in front (proto/framing.hpp).
class GeometryStream {
 public:
  /// `exposure`: of DESIGN section 4, finite and > 0. `threads`: at least 1. Triangles without texels are left out.
  /// `coarse_coverage`: alpha of CoarseTex, one byte for each texel of the layout's last level; empty: opaque.
  [[nodiscard]] static Result<std::shared_ptr<const GeometryStream>> build(
      const scene::Scene& scene, const atlas::Layout& layout, float exposure, unsigned threads,
      std::span<const std::uint8_t> coarse_coverage = {});

  [[nodiscard]] const SharedBytes& manifest() const { return manifest_; }
  /// SceneManifest.tag: not 0; equal for equal manifest and geometry alone (64 bits of hash).
  [[nodiscard]] std::uint64_t tag() const { return tag_; }
  [[nodiscard]] std::size_t chunk_count() const { return chunks_.size(); }
  [[nodiscard]] const SharedBytes& chunk(std::uint32_t index) const { return chunks_[index].bytes; }

  /// All chunks in the order in which a client at `camera` (valid) wants them: first `in_view`, every one that may show
  /// in its picture (boxes against the pyramid of view), then the others; each nearest first, by the distance to the
  /// nearest of its instances.
  struct Order {
    std::vector<std::uint32_t> chunks;
    std::uint32_t in_view = 0;
  };
  [[nodiscard]] Order order_for(const Camera& camera, const Viewport& viewport) const;
  [[nodiscard]] std::size_t total_bytes() const;

  /// Largest chunk: small enough to come in view-sized pieces, large enough to compress well.
  static constexpr std::uint32_t kTrianglesPerChunk = 8192;

 private:
  struct Box {
    glm::vec3 center{0.0f};  // recentred world space
    glm::mat3 half{0.0f};    // from the centre to three faces
    float radius = 0;
  };
  static Box box_of(const ChunkGeometry& geometry, const glm::mat4& to_world);
  struct Chunk {
    SharedBytes bytes;
    std::vector<Box> placed;  // one per instance
  };

  glm::dvec3 origin_{0.0};
  std::uint64_t tag_ = 0;
  SharedBytes manifest_;
  std::vector<Chunk> chunks_;
};

}  // namespace darm::session
