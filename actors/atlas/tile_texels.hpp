// One tile of the atlas, texel by texel: which patch, which triangles, and points of the surface to shade.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "actors/types/ids.hpp"
#include "actors/types/surface_point.hpp"
#include "actors/types/tile_id.hpp"

namespace darm::atlas {

/// A triangle as the tile sees it.
struct TexelFragment {
  std::uint32_t instance = 0;
  std::uint32_t triangle = 0;  ///< Mesh::triangles
  bool front = true;
};

/// Immutable; made by TexelMapper. Texels are named by (x, y) in [0, kTileSize)^2.
class TileTexels {
 public:
  /// Patch that owns the texel (itself or its gutter); kNoPatch where the atlas is empty.
  [[nodiscard]] PatchId patch_at(int x, int y) const { return patches_[texel(x, y)]; }
  /// True if the texel's square holds no surface: it is read by bilinear taps only.
  [[nodiscard]] bool is_gutter(int x, int y) const { return (flags_[texel(x, y)] & kGutter) != 0; }
  /// Triangles that overlap the texel's square; for a gutter texel those less than a texel from its centre. Empty if
  /// the texel is nobody's.
  [[nodiscard]] std::span<const std::uint32_t> candidates(int x, int y) const {
    const auto t = texel(x, y);
    return {candidates_.data() + first_[t], first_[t + 1] - first_[t]};
  }
  [[nodiscard]] const TexelFragment& fragment(std::uint32_t candidate) const { return fragments_[candidate]; }
  [[nodiscard]] std::span<const TexelFragment> fragments() const { return fragments_; }

  /// Point of the surface for the random numbers `xi` in [0, 1)^2: the point of the texel's square at `xi` if a
  /// candidate holds it, else the nearest point of the candidates. In a patch that is one texel, a point spread evenly
  /// over the whole patch. Empty if the texel is nobody's.
  [[nodiscard]] std::optional<SurfacePoint> sample(int x, int y, glm::vec2 xi) const;
  /// The surface at (or nearest to) the texel's centre.
  [[nodiscard]] std::optional<SurfacePoint> center(int x, int y) const;

  [[nodiscard]] std::size_t bytes() const;

 private:
  friend class TileTexelsBuilder;
  static constexpr std::uint8_t kGutter = 1;
  static constexpr std::uint8_t kWholePatch = 2;  ///< the texel is a patch of its own

  [[nodiscard]] static std::size_t texel(int x, int y) { return static_cast<std::size_t>(y * kTileSize + x); }
  [[nodiscard]] SurfacePoint sample_whole(std::span<const std::uint32_t> from, glm::vec2 xi) const;

  std::vector<PatchId> patches_;
  std::vector<std::uint8_t> flags_;
  std::vector<std::uint32_t> first_;       ///< per texel, into candidates_
  std::vector<std::uint32_t> candidates_;  ///< into fragments_
  std::vector<TexelFragment> fragments_;
  /// Corners of the fragments in texels relative to the tile; for patches of one texel the running share of the
  /// patch's area in corner 0's x.
  std::vector<std::array<glm::vec2, 3>> corners_;
};

}  // namespace darm::atlas
