// How many tiles a set of bilinear taps wants, and how full those tiles are (DESIGN "Packing and residency").
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <unordered_map>

#include "actors/atlas/layout.hpp"
#include "actors/types/texel_mask.hpp"

namespace darm::atlas {

/// Counts distinct texels and tiles. Works with any placements: those of a Layout, or of another packing of its
/// patches. Not thread-safe.
class WorkingSetCounter {
 public:
  /// `layout` (and `other`, if given) must outlive the counter. With `other` its placements stand in for level 0, and
  /// only taps at level 0 may be added.
  explicit WorkingSetCounter(const Layout& layout, const Level* other = nullptr) : layout_(layout), other_(other) {}

  /// A bilinear tap at patch position `uv` (world units): the four texels around it.
  void add(PatchId patch, int level, glm::vec2 uv);

  [[nodiscard]] std::uint64_t texels() const;
  [[nodiscard]] std::uint64_t tiles() const { return tiles_.size(); }
  /// texels / (900 * tiles); 0 before the first tap.
  [[nodiscard]] double efficiency() const;
  [[nodiscard]] const std::unordered_map<TileId, TexelMask>& masks() const { return tiles_; }

 private:
  const Layout& layout_;
  const Level* other_;
  std::unordered_map<TileId, TexelMask> tiles_;
};

}  // namespace darm::atlas
