// What a client holds of a recorded stream at a time: page table, slots, CoarseTex. As a client, without drawing.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/encoder/encoder_messages.hpp"
#include "actors/encoder/h264_encoder.hpp"
#include "actors/types/error.hpp"

namespace darm::accuracy {

/// Planes of a decoded picture, kept.
struct DecodedPlanes {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t chroma_width = 0;
  std::uint32_t chroma_height = 0;
  std::vector<std::uint8_t> y, cb, cr;

  [[nodiscard]] static DecodedPlanes copy(const encoder::PlanarPicture& picture);
};

/// Looks are by display RGB (sRGB-encoded, 0..1), bilinear as a client's. Reading is thread-safe.
class ClientState {
 public:
  /// `layout` must outlive it. `phystex_size` as in the stream's format.
  ClientState(const atlas::Layout& layout, std::uint32_t phystex_size);

  /// Page table and slots of one frame. Slots hold their tiles as they were made until set_picture().
  void apply(bool key, std::span<const encoder::PageEdit> edits, std::span<const encoder::SlotWrite> writes);
  /// From now on slots are read from what the codec made of them: a PhysTex of the stream's size, 4:2:0 or 4:4:4.
  void set_picture(DecodedPlanes planes) { picture_ = std::move(planes); }
  /// `width`, `height`: of the coarse level; the coded picture may be larger.
  void set_coarse(DecodedPlanes planes, std::uint32_t width, std::uint32_t height);

  [[nodiscard]] bool has_coarse() const { return !coarse_.y.empty(); }
  [[nodiscard]] SlotIndex slot_of(TileId tile) const;
  /// `at`: in the slot, [1, 31].
  [[nodiscard]] glm::vec3 slot_colour(SlotIndex slot, glm::vec2 at) const;
  /// `texel`: in the coarse level. has_coarse() must hold.
  [[nodiscard]] glm::vec3 coarse_colour(glm::vec2 texel) const;

 private:
  std::uint32_t slots_per_row_;
  std::vector<std::vector<SlotIndex>> pages_;            // by level and tile
  std::vector<std::shared_ptr<const TileImage>> tiles_;  // by slot
  DecodedPlanes picture_;                                // empty: tiles_ as they are
  DecodedPlanes coarse_;
  glm::vec2 coarse_size_{0.0f};
};

}  // namespace darm::accuracy
