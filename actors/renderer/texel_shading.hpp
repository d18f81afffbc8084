// Takes light samples for the texels of one tile that somebody sees, and puts them into the store.
#pragma once

#include <cstdint>

#include "actors/atlas/radiance_store.hpp"
#include "actors/renderer/tile_facts.hpp"
#include "actors/renderer/tile_surface.hpp"
#include "actors/types/error.hpp"
#include "actors/types/texel_mask.hpp"

namespace darm::renderer {

/// How far a tile is: over those texels of a mask that have a surface.
struct TileProgress {
  float least = 0;             ///< soft samples of the texel with fewest
  float mean = 0;              ///< soft samples a texel; under 1 after a first pass
  std::uint32_t texels = 0;    ///< of the mask, with a surface
  std::uint32_t unshaded = 0;  ///< of those, without a sample of sharp light: never looked at
};

struct ShadingResult {
  TileProgress progress;          ///< after the samples
  std::uint32_t samples = 0;      ///< taken, of either layer
  std::uint32_t quarantined = 0;  ///< refused because they were NaN, infinite or absurd
};

/// How far the tile is now. Reads the store.
[[nodiscard]] TileProgress survey_tile(const atlas::RadianceStore& store, TileId tile, const TexelMask& mask,
                                       const TileSurface& surface);

/// The texels that have a sample of any light. Reads the store.
[[nodiscard]] TexelMask lit_texels(const atlas::RadianceStore& store, TileId tile);

/// What becomes of few samples of soft light that were taken when less was known.
enum class Few : std::uint8_t { kKept, kReplaced };
inline constexpr std::uint32_t kReplacedSamples = 8;

/// Where texels of `mask` were never looked at, a first pass: sharp light for each of them, soft light for one texel in
/// four (and for those whose 2x2 block has none of their patch), which the display spreads. Else up to `passes` samples
/// of soft light for each texel; texels that are ahead of the least one by more than that wait, so that newly seen
/// texels catch up, and none goes beyond `most`; of sharp light twice as many where the texel's samples differ (lamps,
/// penumbras, edges), a quarter where they do not. Nothing outside the mask is touched. Sample numbers continue where
/// the store stands, so a restart goes on in the same sequence. `few`: what a texel has of soft light is replaced, not
/// added to, if it is no more than kReplacedSamples. The store is held open only to merge: a crash costs one merge.
/// Fails if the store takes no new tile. One thread per tile.
[[nodiscard]] Result<ShadingResult> shade_tile(atlas::RadianceStore& store, TileId tile, const TexelMask& mask,
                                               std::uint32_t passes, const TileSurface& surface,
                                               std::uint32_t most = 0xffffffffu, Few few = Few::kKept);

}  // namespace darm::renderer
