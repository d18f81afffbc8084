#include "actors/renderer/texel_shading.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "actors/renderer/sampling.hpp"

namespace darm::renderer {

using atlas::Layer;

namespace {

constexpr float kSettled = 0.02f;  // of the texel's light: samples that differ less settle it

struct TexelWork {
  int texel;
  bool replaces;
  atlas::TexelBatch sharp;
  atlas::TexelBatch soft;
};

// A sample that is no light is replaced by one of another number; where that is none either (a texel that fails always
// must not hold up its tile for ever), and where the texel has no point to sample, by black.
template <class Sample>
bool take_sample(const Sample& sample, std::uint32_t number, atlas::TexelBatch& batch) {
  for (const std::uint32_t n : {number, number ^ 0x80000000u})
    if (batch.add(sample(n).value_or(glm::vec3(0.0f)))) return n == number;
  (void)batch.add(glm::vec3(0.0f));
  return false;
}

// How many samples each layer of a texel should have.
struct Goal {
  std::uint32_t sharp = 0;
  std::uint32_t soft = 0;
};

bool sharp_varies(const atlas::TileView& view, int texel) {
  const float n = view.count(Layer::kSharp, texel);
  if (n < 2) return true;
  const float light = luminance(view.mean(Layer::kSharp, texel) + view.mean(Layer::kSoft, texel));
  return view.variance_of_mean(Layer::kSharp, texel, 0) * n > kSettled * kSettled * light * light;
}

// The first texel of a 2x2 block stands for those of its patch.
bool leads(const TileSurface& surface, const TexelMask& mask, int texel) {
  const int x = texel % kTileSize, y = texel / kTileSize;
  const int first = (y & ~1) * kTileSize + (x & ~1);
  return texel == first || !mask.test(first) || surface.patch(first) != surface.patch(texel);
}

TileProgress progress_of(const TexelMask& mask, const TileSurface& surface,
                         const std::optional<atlas::TileView>& view) {
  TileProgress p;
  double sum = 0;
  for (int t = 0; t < kTileTexels; ++t) {
    if (!mask.test(t) || surface.patch(t) == kNobody) continue;
    const float n = view ? view->count(Layer::kSoft, t) : 0.0f;
    p.least = p.texels == 0 ? n : std::min(p.least, n);
    p.unshaded += !view || view->count(Layer::kSharp, t) == 0 ? 1 : 0;
    sum += n;
    ++p.texels;
  }
  if (p.texels > 0) p.mean = static_cast<float>(sum / p.texels);
  return p;
}

}  // namespace

TileProgress survey_tile(const atlas::RadianceStore& store, TileId tile, const TexelMask& mask,
                         const TileSurface& surface) {
  return progress_of(mask, surface, store.read(tile));
}

TexelMask lit_texels(const atlas::RadianceStore& store, TileId tile) {
  TexelMask lit;
  const auto view = store.read(tile);
  for (int t = 0; view && t < kTileTexels; ++t)
    if (view->count(Layer::kSharp, t) > 0 || view->count(Layer::kSoft, t) > 0) lit.set(t % kTileSize, t / kTileSize);
  return lit;
}

Result<ShadingResult> shade_tile(atlas::RadianceStore& store, TileId tile, const TexelMask& mask, std::uint32_t passes,
                                 const TileSurface& surface, std::uint32_t most, Few few) {
  ShadingResult result;
  const auto view = store.read(tile);
  result.progress = progress_of(mask, surface, view);
  if (result.progress.texels == 0 || passes == 0) return result;

  const bool first = result.progress.unshaded > 0;
  const auto soft_goal = std::min(static_cast<std::uint32_t>(result.progress.least) + passes, most);
  std::vector<TexelWork> work;
  for (int t = 0; t < kTileTexels; ++t) {
    if (!mask.test(t) || surface.patch(t) == kNobody) continue;
    const auto have_sharp = view ? static_cast<std::uint32_t>(view->count(Layer::kSharp, t)) : 0u;
    auto have_soft = view ? static_cast<std::uint32_t>(view->count(Layer::kSoft, t)) : 0u;
    const bool replaces = few == Few::kReplaced && have_soft > 0 && have_soft <= kReplacedSamples;
    if (replaces) have_soft = 0;
    Goal goal;
    if (first) {
      goal = {1, leads(surface, mask, t) ? 1u : 0u};
    } else if (have_soft < soft_goal) {
      goal = {std::max(1u, sharp_varies(*view, t) ? 2 * soft_goal : soft_goal / 4), soft_goal};
    }
    TexelWork texel{t, replaces, {}, {}};
    const auto take = [&](std::uint32_t have, std::uint32_t wanted, atlas::TexelBatch& batch, const auto& sample) {
      for (std::uint32_t i = have; i < std::min(wanted, have + 2 * passes); ++i) {
        ++result.samples;
        if (!take_sample(sample, i, batch)) ++result.quarantined;
      }
    };
    take(have_sharp, goal.sharp, texel.sharp, [&](std::uint32_t n) { return surface.sharp(t, n); });
    take(have_soft, std::min(goal.soft, have_soft + passes), texel.soft,
         [&](std::uint32_t n) { return surface.soft(t, n); });
    if (texel.sharp.count > 0 || texel.soft.count > 0) work.push_back(texel);
  }
  if (work.empty()) return result;

  {
    auto update = store.begin_update(tile);
    if (!update) return std::unexpected(update.error());
    for (const auto& w : work) {
      if (w.sharp.count > 0) update->merge(w.texel, Layer::kSharp, w.sharp);
      if (w.soft.count > 0 && w.replaces) update->forget(w.texel, Layer::kSoft);
      if (w.soft.count > 0) update->merge(w.texel, Layer::kSoft, w.soft);
    }
  }
  result.progress = survey_tile(store, tile, mask, surface);
  return result;
}

}  // namespace darm::renderer
