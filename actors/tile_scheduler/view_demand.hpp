// From what is seen to decisions: which tiles should be there, which can be now, what must be shaded. Pure.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/renderer/renderer_messages.hpp"
#include "actors/tile_scheduler/chain_loss.hpp"
#include "actors/tile_scheduler/seen.hpp"
#include "actors/tile_scheduler/slot_allocation.hpp"
#include "actors/tile_scheduler/stream_state.hpp"
#include "actors/tile_scheduler/view_tone.hpp"

namespace darm::tile_scheduler {

/// What a view asks for, or all views of a stream together; newest allocation.
struct ViewDemand {
  std::vector<WeightedChain> chains;
  float lit = 0;                                ///< share of what the target serves whose tiles have pictures, 0..1
  bool crowded = false;                         ///< the sharp tiles do not all fit: what coarser ones lose decides
  bool rests = false;                           ///< it has been looked at closely: slots are chosen with more care
  Moves moves = Moves::kFreely;                 ///< as slots were chosen
  std::vector<ChainLoss> losses;                ///< measured if crowded and there are pictures, else empty
  Allocation target;                            ///< the tiles it should have, pictures or not: these are shaded
  Allocation granted;                           ///< the tiles it can have now: these get slots
  std::vector<renderer::TileRequest> requests;  ///< distinct tiles
  std::vector<renderer::CoarseRequest> coarse;  ///< coarse_texels_seen(), while there is no CoarseTex
};

/// Texels of the coarse level around the set's taps: those that draw a sample, and their neighbours for the samples
/// in between. One request a tile.
[[nodiscard]] std::vector<renderer::CoarseRequest> coarse_texels_seen(const VisibleSet& seen,
                                                                      const atlas::Layout& layout);

/// Distinct tiles at the sharp level of some chain.
[[nodiscard]] std::vector<TileId> sharp_tiles(std::span<const WeightedChain> chains);
/// Those that matter: the heaviest which together have `share` (0..1) of the weight, heaviest first. Most tiles of a
/// view show next to nothing of it.
[[nodiscard]] std::vector<TileId> significant_tiles(std::span<const WeightedChain> chains, double share);

/// What must be shaded for `demand.target`; `seen` is what `demand` was made from.
[[nodiscard]] std::vector<renderer::TileRequest> requests_of(const Seen& seen, const atlas::Layout& layout,
                                                             const ViewDemand& demand);

/// Chooses target and granted tiles for the slots of `table` and makes the shading requests of the target. What coarser
/// levels lose is measured where there are more sharp tiles than slots; `coarse`: see measure_losses().
[[nodiscard]] ViewDemand demand_of(const Seen& seen, const atlas::Layout& layout, const PageTable& table,
                                   const ImageLookup& images, const CoarseLuma* coarse,
                                   const AllocationOptions& options, Moves moves = Moves::kFreely);

/// Sets `demand.lit`; true if every tile of the target has a picture.
bool note_lit(ViewDemand& demand, const ImageLookup& images);

/// Chooses `demand.granted` anew after pictures have come.
void grant_available(ViewDemand& demand, int coarse_level, const PageTable& table, const ImageLookup& images,
                     const AllocationOptions& options);

struct ErrorOptions {
  /// RMS display error of CoarseTex beside its coarseness: of its light, and of being coded in 300 kB.
  float coarse_tex = 0.03f;
  float unlit = 0.25f;  ///< of a sample that nothing serves yet
  float variety = 1;    ///< ViewTone::variety: what coarser texels lose is as much less
};

/// What is plain, black or white is not wrong by as much.
[[nodiscard]] ErrorOptions error_options(const ViewTone& tone);

/// Estimated display error of the light a view has: RMS over its samples of the error of the tile that serves each and
/// of how much coarser than sharp it is (coarseness.hpp). `has_coarse`: CoarseTex serves what no tile does. 0..1.
/// `served`: parallel to `chains`, as Allocation has it.
[[nodiscard]] float view_error(std::span<const WeightedChain> chains, std::span<const std::uint8_t> served,
                               const ImageLookup& images, int coarse_level, bool has_coarse,
                               const ErrorOptions& options = {});
/// Of one view among those that `demand` is of. `known`: numbers of demand.chains; what is not among them has nothing.
[[nodiscard]] float view_error(const VisibleSet& view, const ChainIndex& known, const ViewDemand& demand,
                               const ImageLookup& images, int coarse_level, bool has_coarse,
                               const ErrorOptions& options = {});
/// Share of the samples of `view` whose chains are among `known`, 0..1; 1 without samples on a surface.
[[nodiscard]] float known_share(const VisibleSet& view, const ChainIndex& known);

/// The requests of all views as one working set: weights add, masks join, displayed if any view displays it, as
/// exact as the most exacting one asks.
[[nodiscard]] std::vector<renderer::TileRequest> join_requests(
    const std::vector<const std::vector<renderer::TileRequest>*>& views);

}  // namespace darm::tile_scheduler
