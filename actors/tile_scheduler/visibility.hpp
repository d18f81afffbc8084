// Which tiles and texels a camera sees: passes of interleaved rays, gathered into a VisibleSet.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>

#include "actors/scene/view_materials.hpp"
#include "actors/tile_scheduler/private_set.hpp"
#include "actors/tile_scheduler/view_sampler.hpp"
#include "actors/tile_scheduler/visible_set.hpp"

namespace darm::tile_scheduler {

/// Pixels per side of the block that one ray of a pass stands for, in pictures of up to kMaxRays blocks.
inline constexpr int kBlock = 4;
/// Rays of a pass, about: blocks of larger pictures (1080p is the largest that fits) grow with them, so that no client
/// buys more of the processor with a larger viewport. Footprints and levels are those of the real one.
inline constexpr std::uint32_t kMaxRays = 1u << 17;
/// Passes after which every pixel has been looked at once, and at all four of the client's sample positions.
inline constexpr int kPassesPerPicture = kBlock * kBlock;
inline constexpr int kAllPasses = 4 * kPassesPerPicture;
/// The first passes also note where their samples look (VisibleSet::taps): what coarser levels lose is measured there.
inline constexpr int kTapPasses = 4;

/// Positions within a pixel of the four samples that the client draws with: a 2x2 grid.
inline constexpr std::array<glm::vec2, 4> kClientSamples{
    {{0.25f, 0.25f}, {0.75f, 0.75f}, {0.75f, 0.25f}, {0.25f, 0.75f}}};

/// Where pass 0..kAllPasses-1 puts its ray in each block, pixels in [0, 4)^2. The 16 pixels come in the order of a 4x4
/// Bayer matrix (any first 2^k passes are spread evenly), each time at another of the client's sample positions.
[[nodiscard]] glm::vec2 pass_offset(int pass);

/// Pixels per side of this picture's blocks: kBlock, or as much more as keeps it at about `rays` blocks (at least 1).
[[nodiscard]] float block_side(const Viewport& viewport, std::uint32_t rays = kMaxRays);
/// Passes after which there has been one sample per pixel: kPassesPerPicture with blocks of kBlock.
[[nodiscard]] int passes_per_picture(const Viewport& viewport, std::uint32_t rays = kMaxRays);
/// Blocks of a picture; a pass traces one ray per block whose position lies inside the picture.
[[nodiscard]] std::uint32_t block_rows(const Viewport& viewport, std::uint32_t rays = kMaxRays);
[[nodiscard]] std::uint32_t block_columns(const Viewport& viewport, std::uint32_t rays = kMaxRays);

/// Traces rows [first_row, last_row) of blocks in pass `pass` into `out`. In the first passes_per_picture() passes each
/// sample also marks the texels around it that the unseen pixels of its block probably read (TileUse::early).
void trace_rows(const ViewSampler& sampler, int pass, std::uint32_t first_row, std::uint32_t last_row, VisibleSet& out);

/// What of the samples depends on the eye: how much of it is told by the VisibleSet, and what a private layer would
/// hold of it is gathered beside that.
struct PrivateSamples {
  std::span<const scene::ViewMaterial> materials;  ///< by instance; empty: nothing is known
  PrivateSet* set = nullptr;                       ///< null: nothing is gathered
};
/// `rays`: of a pass, as block_side() has it. Fewer than kMaxRays make a glance, not a pass.
void trace_rows(const ViewSampler& sampler, int pass, std::uint32_t first_row, std::uint32_t last_row, VisibleSet& out,
                const PrivateSamples& own, std::uint32_t rays = kMaxRays);

/// Chain of a surface sample: its tile at the sharp level and at up to three coarser ones.
[[nodiscard]] Chain chain_of(const atlas::Layout& layout, const SurfaceSample& sample);

/// Adds one surface sample: its chain, the bilinear taps at each level of the chain (also as SampleTaps if
/// `note_taps`), and texels within `early_pixels` of it (half the side of the square of pixels it stands for; 0: none).
void add_sample(const atlas::Layout& layout, const SurfaceSample& sample, float early_pixels, bool note_taps,
                VisibleSet& out);

}  // namespace darm::tile_scheduler
