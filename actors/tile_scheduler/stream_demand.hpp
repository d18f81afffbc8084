// The slots of one stream among the views that share it. Pure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "actors/tile_scheduler/view_demand.hpp"

namespace darm::tile_scheduler {

/// Several views as one: each view's weights are shares of its own picture and add up, so that a large view counts for
/// no more than a small one, and a tile for as much as all who see it.
struct JointView {
  std::vector<WeightedChain> chains;               ///< distinct
  std::vector<ChainLoss> losses;                   ///< means of the views', by weight; empty unless all are measured
  std::vector<std::vector<std::uint32_t>> number;  ///< per view: of each of its chains, in `chains`
  bool rests = false;                              ///< all of them do
};
[[nodiscard]] JointView join_views(std::span<const ViewDemand* const> views);

/// Chooses the target tiles of all `views`, which share the slots of `table`, and then what is granted of them. For
/// streams whose sharp tiles do not all fit; where they do, views need nothing of each other (demand_of()).
/// `joint`: join_views() of the same views.
void share_slots(std::span<ViewDemand* const> views, const JointView& joint, const PageTable& table,
                 const ImageLookup& images, int coarse_level, const AllocationOptions& options);
/// Chooses granted tiles anew after pictures have come.
void share_available(std::span<ViewDemand* const> views, const JointView& joint, const PageTable& table,
                     const ImageLookup& images, int coarse_level, const AllocationOptions& options);

}  // namespace darm::tile_scheduler
