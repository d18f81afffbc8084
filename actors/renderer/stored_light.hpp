// Light that is already known, for rays to end in: irradiance of the whole scene at the coarse level.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/atlas/radiance_store.hpp"
#include "actors/renderer/bright_texels.hpp"
#include "actors/renderer/filter_irradiance.hpp"
#include "actors/renderer/light_guess.hpp"
#include "actors/renderer/trace/surface.hpp"

namespace darm::renderer {

/// One texel: irradiance / pi (nits) of its side of the surface, by layer.
struct StoredTexel {
  glm::vec3 sharp{0.0f};
  glm::vec3 soft{0.0f};
  bool known = false;
  float soft_variance = 0;  ///< of the luminance of `soft`: noise, nits squared
};

/// What a tile of the store holds, as StoredTexels; soft light as filtered in `filtered` (32x32, of a slot with its
/// border) where that is known. Lightless texels stay unknown.
[[nodiscard]] std::array<StoredTexel, kTileTexels> stored_texels(const atlas::TileView& tile,
                                                                 std::span<const FilteredTexel> filtered);

/// A snapshot: filled once (different tiles may come from different threads), then read by any thread.
class StoredLight {
 public:
  explicit StoredLight(std::shared_ptr<const atlas::Layout> layout);

  /// `texels`: the tile's kTileTexels payload texels, row by row. Values that are not finite and >= 0 become unknown.
  void put(std::uint32_t tile_index, std::span<const StoredTexel> texels);

  /// Irradiance / pi at a surface point on the side `s.front` says. `xi` in [0, 1)^2 picks one of the four texels
  /// around it with its bilinear weight, so that the mean over xi is the bilinear value for the price of one. Null:
  /// not known (no texels on that side, not lit yet).
  [[nodiscard]] const StoredTexel* find(const trace::Surface& s, const glm::vec2& xi) const;

  /// The bilinear value at texel position `at` (continuous, as Layout::texel_at) of a patch at `level`, out of those of
  /// its four texels that are known. nullopt: none is. The patch must own the place, its gutter included.
  [[nodiscard]] std::optional<LightGuess> guess(PatchId patch, int level, const glm::vec2& at) const;

  /// The brightest of its texels, for paths to aim at; none until they are given. Not while another thread reads.
  [[nodiscard]] const BrightTexels& bright() const { return bright_; }
  void give_bright(BrightTexels bright) { bright_ = std::move(bright); }

  /// Row-major over the coarse level.
  [[nodiscard]] std::span<const StoredTexel> texels() const { return texels_; }
  [[nodiscard]] const std::shared_ptr<const atlas::Layout>& layout() const { return layout_; }
  /// The level it is of.
  [[nodiscard]] int level() const { return layout_->coarse_level(); }
  /// A ray shorter than this ends too near its start for texels of the coarse level: corners and contacts would smear.
  [[nodiscard]] float least_distance() const { return least_distance_; }

 private:
  std::shared_ptr<const atlas::Layout> layout_;
  float least_distance_ = 0;
  std::vector<StoredTexel> texels_;
  BrightTexels bright_;
};

}  // namespace darm::renderer
