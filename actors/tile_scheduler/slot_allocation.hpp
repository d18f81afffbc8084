// Which tiles get the slots of a PhysTex: those that bring most accuracy on screen. Pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "actors/tile_scheduler/chain.hpp"

namespace darm::tile_scheduler {

struct AllocationOptions {
  /// Loss of a sample drawn i levels coarser than sharp. Rises faster than linearly, so that levels coarsen evenly.
  std::array<float, 4> loss{0.0f, 1.0f, 2.2f, 3.5f};
  float loss_per_further_level = 1.4f;  ///< for CoarseTex, when it is more than three levels coarser
  float coarse_penalty = 0.5f;          ///< CoarseTex is also the least well lit: it loses this much more
  float resident_bonus = 0.05f;         ///< a resident tile's gain counts for this much more
  float least_improvement = 0.1f;       ///< residents stay if moving lessens what is lost by at most this share of it
  float negligible = 1e-4f;             ///< or by at most this share of the benefit that slots without limit would have
  float resting_bonus = 1.0f;           ///< resident_bonus while Moves::kFew and kHardlyAny
  float rested_improvement = 1.0f;      ///< least_improvement while Moves::kHardlyAny
};

/// How readily tiles change hands. Gains are measured on pictures whose light still converges, and the best of many
/// that are known roughly is mostly the one that was measured too high: choosing anew whenever pictures have come moves
/// hundreds of tiles each time, for ever, and leaves more lost than staying does.
enum class Moves : std::uint8_t {
  kFreely,     ///< other things are seen than before: the best choice, if it is worth it as a whole
  kFew,        ///< the view rests: a resident gives way to a tile that brings twice as much (resting_bonus)
  kHardlyAny,  ///< it has rested for long: and that only where as much again is lost as would be otherwise
};

struct AllocationRequest {
  std::span<const WeightedChain> chains;    ///< distinct chains, weights >= 0
  std::span<const TileId> residents;        ///< distinct tiles
  std::function<bool(TileId)> available{};  ///< tiles that may be granted; null: all
  /// measure_losses(): parallel to `chains`, rising with the position. Empty: not known, serving_loss() stands in.
  std::span<const ChainLoss> losses;
  std::size_t slots = 0;
  int coarse_level = 0;  ///< Layout::coarse_level()
  Moves moves = Moves::kFreely;
  /// Also exchange tiles after the greedy choice: a few percent less is lost, for about twice the time.
  bool exchange = true;
};

/// The tiles to hold and what they serve.
struct Allocation {
  std::vector<TileId> tiles;         ///< at most `slots`, each serving some chain, by falling served weight
  std::vector<float> weights;        ///< parallel to `tiles`: weight of the chains it serves
  std::vector<std::uint8_t> served;  ///< per chain: position 0..3 of its finest tile granted, else kServedByCoarse
  double benefit = 0;                ///< sum over chains of weight * (loss by CoarseTex - loss as served)
};

/// Maximises the benefit under the slot limit. If every chain's finest available tile fits, that is the answer
/// (optimal); else lazy greedy (Minoux 1978) on the facility-location gain, at least 1 - 1/e of the optimum but for the
/// residents' bonus, and then tiles are exchanged while that helps. Deterministic. O(entries log entries) with few
/// recomputations in practice.
[[nodiscard]] Allocation allocate_slots(const AllocationRequest& request, const AllocationOptions& options = {});

/// Loss, by the options' table, of a chain served at `position` (0..3 or kServedByCoarse).
[[nodiscard]] float serving_loss(const Chain& chain, int position, int coarse_level, const AllocationOptions& options);

}  // namespace darm::tile_scheduler
