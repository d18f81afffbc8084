// The few texels of stored light that are far brighter than the rest, to draw points of: the ceiling over a lamp, the
// floor where the sun meets it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "actors/atlas/texel_map.hpp"
#include "actors/renderer/trace/surface.hpp"
#include "actors/types/surface_point.hpp"

namespace darm::renderer {

class LightTransport;
class StoredLight;

/// A cosine-weighted ray meets a bright spot of a hundredth of its hemisphere once in a hundred: most of a room's light
/// is then in rare samples. Such texels are lights like any other (after Keller, Instant Radiosity, 1997, with texels
/// for points), drawn by what they send to the receiver as if nothing stood between, and combined with the rays that
/// find them by chance (multiple importance sampling, Veach 1995): the expectation is the same, whatever is in here.
/// Texels stand in groups of one neighbourhood and facing, so that weighing all of them is cheap. Immutable;
/// thread-safe.
class BrightTexels {
 public:
  static constexpr std::size_t kMostGroups = 64;

  /// None.
  BrightTexels() = default;
  /// Those of `light` that stand out, and none where light is even enough for rays to find it by chance. Only of opaque
  /// surfaces that neither emit nor transmit, which is where paths end. Not for the inner loop: reads all
  /// texels.
  BrightTexels(const StoredLight& light, const atlas::TexelMapper& mapper, const LightTransport& transport);

  [[nodiscard]] bool empty() const { return texels_.empty(); }
  [[nodiscard]] std::size_t size() const { return texels_.size(); }

  /// Where the texel numbered `i` of size() lies: tile of the coarse level, texel of that.
  struct Place {
    std::uint32_t tile;
    int texel;
    float flux;   ///< radiance times area
    float soft;   ///< what soft light is of that
    float share;  ///< of its irradiance / pi that is flux: albedo times area
  };
  [[nodiscard]] Place place(std::size_t i) const;

  /// What the groups are worth for one receiver.
  struct Aim {
    float chance = 0;                        ///< of drawing a point, 0..1; 0: chance rays do
    float spread = 0;                        ///< variance of what rays find by chance, over the square of its mean
    float sum = 0;                           ///< of the weights
    std::array<float, kMostGroups> weights;  ///< of the first groups; not set where `chance` is 0
  };
  /// `normal`: unit. `light`: what is known of the soft irradiance / pi there, nits; < 0: nothing.
  [[nodiscard]] Aim aim(const glm::vec3& position, const glm::vec3& normal, float light) const;

  /// nullopt: nothing drawn (the surface fills only a part of the texel). `aim.chance` must be > 0; `xi`, `place` in
  /// [0, 1).
  [[nodiscard]] std::optional<SurfacePoint> draw(const Aim& aim, float xi, const glm::vec2& place) const;

  /// Density per m2 with which draw() gives a point of a triangle of that area, m2; 0: never.
  [[nodiscard]] float pdf_area(const Aim& aim, const SurfacePoint& point, float triangle_area) const;

 private:
  struct Texel {
    std::uint32_t tile = 0;  // of tiles_
    std::uint16_t x = 0, y = 0;
    std::uint32_t group = 0;
    float flux = 0, soft = 0, share = 0;
    float probability = 0;  // within its group
    float reached = 0;      // sum of the probabilities up to and with it
  };
  struct Found;
  void build(const StoredLight& light, const atlas::TexelMapper& mapper, const LightTransport& transport,
             std::uint32_t stride);
  [[nodiscard]] std::vector<Found> find(const StoredLight& light, const atlas::TexelMapper& mapper,
                                        const LightTransport& transport, std::uint32_t stride);
  [[nodiscard]] float share_of_wide(const StoredLight& light, const atlas::TexelMapper& mapper,
                                    const LightTransport& transport) const;
  void group(std::vector<Found>& found);
  void add_group(const Found* first, const Found* end);
  [[nodiscard]] float texels_per_area(const SurfacePoint& point, float triangle_area) const;

  std::shared_ptr<const atlas::Layout> layout_;
  std::vector<std::shared_ptr<const atlas::TileTexels>> tiles_;
  std::vector<std::uint32_t> tile_index_;  // of tiles_, at the coarse level
  std::vector<Texel> texels_;              // by group
  std::vector<std::uint32_t> number_;      // of a texel of the level, row-major: 1 + index into texels_; 0: not bright
  std::vector<std::uint32_t> first_;       // of each group, in texels_; and their end
  float rest_ = 0;                         // mean radiance of the other texels, nits
  float cell_ = 0;                         // half a group's extent, metres, at most
  // Of each group: where, facing, radiance times area over pi, mean radiance, mean square of the distance from its
  // middle, half its extent, and how far it is from flat.
  std::vector<float> x_, y_, z_, normal_x_, normal_y_, normal_z_, flux_, radiance_, square_, half_, depth_;
};

}  // namespace darm::renderer
