// What one camera sees that depends on its eye: chains by what they are worth, tiles with the slot texels that are
// read.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/scene/view_materials.hpp"
#include "actors/tile_scheduler/chain.hpp"
#include "actors/tile_scheduler/view_sampler.hpp"
#include "actors/types/slot_mask.hpp"

namespace darm::tile_scheduler {

/// Accumulates samples of one camera. Bounded: past the limits new chains and tiles are left out (and counted).
/// A sample of a rough material starts its chain at a coarser level than the sharp one: the client walks there.
class PrivateSet {
 public:
  static constexpr std::size_t kMaxChains = 65536;
  static constexpr std::size_t kMaxTiles = 16384;

  /// One surface sample; nothing if the material has no weight. Texels within `early_pixels` are marked as well: unseen
  /// pixels beside it probably read them.
  void add(const atlas::Layout& layout, const SurfaceSample& sample, const scene::ViewMaterial& material,
           float early_pixels);
  void add_samples(double count) { samples_ += count; }
  void merge(const PrivateSet& other);
  void clear() { *this = PrivateSet{}; }

  [[nodiscard]] bool empty() const { return chains_.size() == 0; }
  [[nodiscard]] double samples() const { return samples_; }
  [[nodiscard]] const std::vector<Chain>& chains() const { return chains_.keys(); }
  [[nodiscard]] std::span<const float> worths() const { return worths_; }  ///< sums of weights, parallel to chains()
  /// Sums of ViewMaterial::omitted, squared; parallel to chains().
  [[nodiscard]] std::span<const float> squares() const { return squares_; }
  [[nodiscard]] std::span<const float> counts() const { return counts_; }  ///< samples, parallel to chains()
  /// Texels read of a tile, at whatever level it serves; null if none.
  [[nodiscard]] const SlotMask* find(TileId tile) const;
  [[nodiscard]] std::size_t left_out() const { return left_out_; }

 private:
  SlotMask* mask_of(TileId tile);
  void count(const Chain& chain, float worth, float square, float samples);

  ChainIndex chains_;
  std::vector<float> worths_;
  std::vector<float> squares_;
  std::vector<float> counts_;
  TileIndex tiles_;
  std::vector<SlotMask> masks_;
  double samples_ = 0;
  std::size_t left_out_ = 0;
};

}  // namespace darm::tile_scheduler
