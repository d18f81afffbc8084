// What one camera sees, gathered sample by sample: chains with their sample counts, tiles with the texels that are
// read.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "actors/tile_scheduler/chain.hpp"
#include "actors/types/texel_mask.hpp"

namespace darm::tile_scheduler {

/// Texels of one tile that are read, by reason.
struct TileUse {
  TexelMask sharp;     ///< read by samples of this tile whose sharp level it is
  TexelMask early;     ///< probably read so: within the footprint of the block of pixels a sparse sample stands for
  TexelMask fallback;  ///< read by samples of this tile if it serves a finer chain
  TexelMask border;    ///< read by samples of a neighbouring tile across the edge

  /// Those that hold something; a mask that is none of them is empty. (Most tiles have one, and a set has thousands.)
  enum Kind : std::uint8_t { kSharp = 1, kEarly = 2, kFallback = 4, kBorder = 8 };
  std::uint8_t kinds = 0;
  TexelMask& mark(Kind kind) {
    kinds |= kind;
    return kind == kSharp ? sharp : kind == kEarly ? early : kind == kFallback ? fallback : border;
  }
};

/// Accumulates samples of one camera. Bounded: past the limits new chains and tiles are left out (and counted).
class VisibleSet {
 public:
  static constexpr std::size_t kMaxChains = 262144;
  static constexpr std::size_t kMaxTiles = 65536;
  static constexpr std::size_t kMaxTaps = 262144;
  static constexpr std::uint32_t kLeftOut = ChainIndex::kAbsent;

  /// `count` more samples use `chain`. Its number; kLeftOut if the set is full.
  std::uint32_t add(const Chain& chain, float count);
  /// Where a sample of chain number `taps.chain` looks.
  void add_taps(const SampleTaps& taps);
  /// Squared display error of a sample for want of finer texels than the atlas has.
  void add_magnified(double squared_error) { magnified_ += squared_error; }
  /// A sample's ViewMaterial::squared_omitted() and ViewMaterial::diffuse.
  void add_omitted(double squared_error, double diffuse) {
    omitted_ += squared_error;
    diffuse_ += diffuse;
  }
  /// A sample that hit nothing: counts in samples() only.
  void add_samples(double count) { samples_ += count; }
  /// The texels of `tile`; null if the set is full. Valid until the next call.
  TileUse* use(TileId tile);
  /// `share`: of the weight of the other's samples; more taps than `most_taps` are left out.
  void merge(const VisibleSet& other, float share = 1.0f, std::size_t most_taps = kMaxTaps);
  /// Room for so many, so that tables need not grow step by step.
  void reserve(std::size_t chains, std::size_t tiles);
  void forget_early();
  void clear();

  [[nodiscard]] double samples() const { return samples_; }  ///< picture samples traced, hits or not
  [[nodiscard]] const std::vector<Chain>& chains() const { return chains_.keys(); }
  [[nodiscard]] const ChainIndex& chain_index() const { return chains_; }
  [[nodiscard]] std::span<const float> counts() const { return counts_; }  ///< parallel to chains()
  [[nodiscard]] std::span<const SampleTaps> taps() const { return taps_; }
  [[nodiscard]] const std::vector<TileId>& tiles() const { return tiles_.keys(); }
  [[nodiscard]] std::span<const TileUse> uses() const { return uses_; }  ///< parallel to tiles()
  [[nodiscard]] const TileUse* find(TileId tile) const;
  [[nodiscard]] std::size_t left_out() const { return left_out_; }
  /// RMS over the samples on surfaces of what add_magnified() was told, 0..1.
  [[nodiscard]] float resolution_error() const;
  /// RMS over the same of what add_omitted() was told, and the mean albedo, 0..1.
  [[nodiscard]] float omitted_error() const;
  [[nodiscard]] float mean_diffuse() const;
  /// Samples on surfaces: a layer of glass and what is behind it count both.
  [[nodiscard]] double surface_samples() const { return surface_samples_; }

 private:
  static constexpr std::array<TileId, kMaxLevels> no_tiles() {
    std::array<TileId, kMaxLevels> none;
    none.fill(kNoTile);
    return none;
  }

  ChainIndex chains_;
  std::vector<float> counts_;
  std::vector<SampleTaps> taps_;
  TileIndex tiles_;
  std::vector<TileUse> uses_;
  double samples_ = 0;
  double surface_samples_ = 0;
  double magnified_ = 0;
  double omitted_ = 0;
  double diffuse_ = 0;
  std::size_t left_out_ = 0;
  // Neighbouring samples mostly share chain and tiles: the last tile of each level, the last chain.
  std::array<TileId, kMaxLevels> last_tile_ = no_tiles();
  std::array<std::uint32_t, kMaxLevels> last_index_{};
  std::uint32_t last_chain_ = 0;
};

}  // namespace darm::tile_scheduler
