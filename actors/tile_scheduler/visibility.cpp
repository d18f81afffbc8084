#include "actors/tile_scheduler/visibility.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "actors/tile_scheduler/coarseness.hpp"
#include "actors/tile_scheduler/texel_taps.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr float kMaxEarlyTexels = 12.0f;

// Bayer order of the pixels of a block: x and y of the pass-th pixel. Bits of `pass` from high resolution to low.
constexpr std::array<std::array<std::uint8_t, 2>, kPassesPerPicture> kOrder{{{0, 0},
                                                                             {2, 2},
                                                                             {2, 0},
                                                                             {0, 2},
                                                                             {1, 1},
                                                                             {3, 3},
                                                                             {3, 1},
                                                                             {1, 3},
                                                                             {1, 0},
                                                                             {3, 2},
                                                                             {3, 0},
                                                                             {1, 2},
                                                                             {0, 1},
                                                                             {2, 3},
                                                                             {2, 1},
                                                                             {0, 3}}};

void set_box(TexelMask& mask, const TexelBox& part) {
  for (int y = part.y0; y <= part.y1; ++y) mask.set_row(part.x0, part.x1, y);
}

// Where texel position `texel` lies inside the slot of its tile: the payload begins at 1.
glm::vec2 in_slot(const atlas::Level& level, TileId tile, glm::vec2 texel) {
  return texel - glm::vec2(tile.index() % level.tiles_x, tile.index() / level.tiles_x) * float{kTileSize} + 1.0f;
}

// Texels around a sample that the pixels within `pixels` of it read if they see the same patch: the bounding box of
// their footprint parallelogram, clipped to the texels the patch can read.
void mark_early(const atlas::Layout& layout, const SurfaceSample& sample, float pixels, VisibleSet& out) {
  const auto& level = layout.levels[static_cast<std::size_t>(sample.level)];
  const auto& place = level.placements[index_of(sample.patch)];
  const float scale = place.scale * level.density;
  glm::vec2 reach = (glm::abs(sample.uv_dx) + glm::abs(sample.uv_dy)) * (pixels * scale);
  if (!std::isfinite(reach.x) || !std::isfinite(reach.y)) return;
  reach = glm::min(reach, glm::vec2(kMaxEarlyTexels));
  const glm::vec2 texel = layout.texel_at(sample.patch, sample.level, sample.uv);
  const TexelBox low = taps_at(level, texel - reach);
  const TexelBox high = taps_at(level, texel + reach);
  const glm::vec2 extent = sample.patch_size * scale;
  TexelBox box;
  box.x0 = std::max(low.x0, static_cast<int>(place.x));
  box.y0 = std::max(low.y0, static_cast<int>(place.y));
  box.x1 = std::min(high.x1, static_cast<int>(place.x) + static_cast<int>(std::ceil(extent.x)));
  box.y1 = std::min(high.y1, static_cast<int>(place.y) + static_cast<int>(std::ceil(extent.y)));
  if (box.x0 > box.x1 || box.y0 > box.y1) return;
  for_each_tile_part(level, sample.level, box, [&](TileId tile, const TexelBox& part) {
    if (auto* use = out.use(tile)) set_box(use->mark(TileUse::kEarly), part);
  });
}

}  // namespace

glm::vec2 pass_offset(int pass) {
  const auto within = static_cast<std::size_t>(pass % kPassesPerPicture);
  const auto round = static_cast<std::size_t>(pass / kPassesPerPicture);
  const auto& pixel = kOrder[within];
  // A Latin arrangement: each pixel sees another sample position in each of the four rounds, and each round all four.
  const auto sample = (within + (within >> 2) + round) % kClientSamples.size();
  return glm::vec2(pixel[0], pixel[1]) + kClientSamples[sample];
}

float block_side(const Viewport& viewport, std::uint32_t rays) {
  const double pixels = double(viewport.width) * double(viewport.height);
  return static_cast<float>(std::max(double{kBlock}, std::sqrt(pixels / std::clamp(rays, 1u, kMaxRays))));
}

int passes_per_picture(const Viewport& viewport, std::uint32_t rays) {
  const float side = block_side(viewport, rays);
  return static_cast<int>(std::ceil(side * side));
}

std::uint32_t block_rows(const Viewport& viewport, std::uint32_t rays) {
  return static_cast<std::uint32_t>(std::ceil(static_cast<float>(viewport.height) / block_side(viewport, rays)));
}
std::uint32_t block_columns(const Viewport& viewport, std::uint32_t rays) {
  return static_cast<std::uint32_t>(std::ceil(static_cast<float>(viewport.width) / block_side(viewport, rays)));
}

Chain chain_of(const atlas::Layout& layout, const SurfaceSample& sample) {
  Chain chain;
  const int length = std::min(kChainLength, layout.coarse_level() - sample.level + 1);
  for (int i = 0; i < length; ++i) {
    const auto texel = layout.texel_at(sample.patch, sample.level + i, sample.uv);
    chain.tiles[static_cast<std::size_t>(i)] = tile_holding(layout, sample.level + i, texel);
  }
  return chain;
}

void add_sample(const atlas::Layout& layout, const SurfaceSample& sample, float early_pixels, bool note_taps,
                VisibleSet& out) {
  const Chain chain = chain_of(layout, sample);
  SampleTaps taps;
  taps.chain = out.add(chain, 1.0f);
  if (const float lost = error_of_coarser(octaves_magnified(sample.pixel_texels)); lost > 0)
    out.add_magnified(double{lost} * double{lost});
  for (std::size_t i = 0; i < chain.tiles.size() && chain.tiles[i] != kNoTile; ++i) {
    const int level_number = sample.level + static_cast<int>(i);
    const auto& level = layout.levels[static_cast<std::size_t>(level_number)];
    const auto texel = layout.texel_at(sample.patch, level_number, sample.uv);
    taps.set(i, in_slot(level, chain.tiles[i], texel));
    const auto box = taps_at(level, texel);
    for_each_tile_part(level, level_number, box, [&](TileId tile, const TexelBox& part) {
      auto* use = out.use(tile);
      if (use == nullptr) return;
      set_box(use->mark(tile != chain.tiles[i] ? TileUse::kBorder
                        : i == 0               ? TileUse::kSharp
                                               : TileUse::kFallback),
              part);
    });
  }
  if (note_taps) {
    const auto texel = layout.texel_at(sample.patch, layout.coarse_level(), sample.uv) * 8.0f + 0.5f;
    for (int axis = 0; axis < 2; ++axis)
      if (texel[axis] > 0 && texel[axis] < 65535.0f)
        taps.coarse[static_cast<std::size_t>(axis)] = static_cast<std::uint16_t>(texel[axis]);
    out.add_taps(taps);
  }
  if (early_pixels > 0) mark_early(layout, sample, early_pixels, out);
}

void trace_rows(const ViewSampler& sampler, int pass, std::uint32_t first_row, std::uint32_t last_row,
                VisibleSet& out) {
  trace_rows(sampler, pass, first_row, last_row, out, {});
}

void trace_rows(const ViewSampler& sampler, int pass, std::uint32_t first_row, std::uint32_t last_row, VisibleSet& out,
                const PrivateSamples& own, std::uint32_t rays) {
  const renderer::trace::DenormalsAreZero denormals;
  const auto& viewport = sampler.viewport();
  const float side = block_side(viewport, rays);
  const glm::vec2 offset = pass_offset(pass) * (side / kBlock);
  // After k passes a sample stands for a square of side / sqrt(k) pixels a side; the reach is half of it.
  const float early =
      pass < passes_per_picture(viewport, rays) ? 0.5f * side / std::sqrt(static_cast<float>(pass + 1)) : 0.0f;
  const bool note_taps = pass < kTapPasses;
  const bool gather = own.set != nullptr && !own.materials.empty();
  const auto width = static_cast<float>(viewport.width);
  const auto height = static_cast<float>(viewport.height);
  const auto columns = block_columns(viewport, rays);
  std::array<SurfaceSample, kMaxLayers> surfaces;
  double samples = 0;
  for (std::uint32_t row = first_row; row < last_row; ++row) {
    const float y = static_cast<float>(row) * side + offset.y;
    if (y >= height) break;
    for (std::uint32_t column = 0; column < columns; ++column) {
      const float x = static_cast<float>(column) * side + offset.x;
      if (x >= width) break;
      const int layers = sampler.trace(x, y, surfaces);
      for (std::size_t i = 0; i < static_cast<std::size_t>(layers); ++i) {
        add_sample(sampler.layout(), surfaces[i], early, note_taps, out);
        if (own.materials.empty()) continue;
        const auto& material = own.materials[surfaces[i].instance];
        out.add_omitted(double{material.squared_omitted(surfaces[i].cosine)}, double{material.diffuse});
        if (gather) own.set->add(sampler.layout(), surfaces[i], material, early);
      }
      ++samples;
    }
  }
  out.add_samples(samples);
  if (gather) own.set->add_samples(samples);
}

}  // namespace darm::tile_scheduler
