// How bright and how varied a view is, by what CoarseTex shows of it: estimates of errors are for a usual picture, and
// what is black, white or plain cannot be wrong by as much.
#pragma once

#include "actors/tile_scheduler/tile_scheduler_messages.hpp"
#include "actors/tile_scheduler/visible_set.hpp"

namespace darm::tile_scheduler {

/// Of a usual picture until something tells.
struct ViewTone {
  /// Linear exposed radiance from everywhere that would light what is seen as it is lit: mean of the picture over mean
  /// albedo, at most 1.
  float surroundings = 0.3f;
  float brightness = 0.4f;  ///< RMS of display values, 0..1
  float headroom = 0.6f;    ///< RMS of what display values are under white, 0..1
  /// Root of: RMS difference of neighbouring texels of CoarseTex, display values, over that of a usual picture; at most
  /// 1. The root, because CoarseTex does not show how sharp its edges are.
  float variety = 1;
  float coarse_light = 0.025f;  ///< RMS display error of CoarseTex's light there, 0..1
};

/// Looks at some thousand of the view's taps. The usual one without CoarseTex or taps.
[[nodiscard]] ViewTone tone_of(const VisibleSet& view, const CoarseLuma* coarse);

/// Expected RMS display error (0..1) over the view's samples of leaving out what depends on the eye: what the materials
/// would show of a grey surrounding as bright as the view is lit, and no more than there is room for under white. A
/// mean: a lamp's highlight on a floor is more, a dark corner less.
[[nodiscard]] float omitted_error(const VisibleSet& view, const ViewTone& tone);
/// What it multiplies errors of ViewMaterial::omitted with.
[[nodiscard]] float shown_of_omitted(const ViewTone& tone);

}  // namespace darm::tile_scheduler
