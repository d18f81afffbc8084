// A still view drawn as a client draws it, in software: where each sample looks is traced once.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/renderer/picture_io.hpp"
#include "actors/renderer/trace/ray_scene.hpp"
#include "actors/types/camera.hpp"
#include "daemon/accuracy/client_state.hpp"

namespace darm::accuracy {

/// Pixels of which every sample shows an opaque surface: the others are not counted in any error, since the sky and
/// what is seen through need no light of the atlas. One byte a pixel, 1: counted.
using PixelMask = std::vector<std::uint8_t>;
/// Share of the pixels that are counted, 0..1.
[[nodiscard]] double counted_share(const PixelMask& mask);

class SoftwareView {
 public:
  /// `layout` (of rays.scene()) must outlive it. Uses `threads` threads, which have ended when it returns.
  SoftwareView(const atlas::Layout& layout, const renderer::trace::RayScene& rays, const Camera& camera,
               const Viewport& viewport, unsigned threads);

  [[nodiscard]] const PixelMask& counted() const { return counted_; }
  /// Share of the samples that count which draw() would take from tiles, 0..1: the others lie in CoarseTex.
  [[nodiscard]] double share_of_tiles(const ClientState& state, unsigned threads) const;
  /// The picture, linear and display-referred: four samples a pixel, each from its sharp level or up to three coarser
  /// ones, else from CoarseTex. Pixels that are not counted are black. `state.has_coarse()` must hold.
  [[nodiscard]] renderer::Picture draw(const ClientState& state, unsigned threads) const;

 private:
  // Where a client's sample lies: 16 bytes, since there are four a pixel.
  struct Look {
    std::uint32_t patch = 0;
    std::int32_t level = -1;  // -1: nothing that counts
    glm::vec2 uv{0.0f};
  };
  // A tile that is there, and how far from its sharp level.
  struct Found {
    SlotIndex slot = kNoSlot;
    TileId tile;
    glm::vec2 texel{0.0f};
  };
  [[nodiscard]] Found find(const Look& look, const ClientState& state) const;
  [[nodiscard]] glm::vec3 colour(const Look& look, const ClientState& state) const;

  const atlas::Layout& layout_;
  Viewport viewport_;
  std::vector<Look> looks_;
  PixelMask counted_;
};

}  // namespace darm::accuracy
