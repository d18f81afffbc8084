#include "actors/renderer/texel_shading.hpp"

#include <algorithm>
#include <optional>
#include <vector>

namespace darm::renderer {

using atlas::Layer;

namespace {

struct TexelWork {
  int texel;
  atlas::TexelBatch sharp;
  atlas::TexelBatch soft;
};

// A sample that is no light is replaced by one of another number; where that is none either (a texel that fails always
// must not hold up its tile for ever), and where the texel has no point to sample, by black.
bool take_sample(const TileSurface& surface, int texel, std::uint32_t number, TexelWork& work) {
  for (const std::uint32_t n : {number, number ^ 0x80000000u}) {
    const TexelLight light = surface.light(texel, n).value_or(TexelLight{});
    atlas::TexelBatch sharp = work.sharp;
    if (sharp.add(light.sharp) && work.soft.add(light.soft)) {
      work.sharp = sharp;
      return n == number;
    }
  }
  (void)work.sharp.add(glm::vec3(0.0f));
  (void)work.soft.add(glm::vec3(0.0f));
  return false;
}

template <class CountOf>
TileProgress progress_of(const TexelMask& mask, const TileSurface& surface, CountOf&& count_of) {
  TileProgress p;
  double sum = 0;
  for (int t = 0; t < kTileTexels; ++t) {
    if (!mask.test(t) || surface.patch(t) == kNobody) continue;
    const float n = count_of(t);
    p.least = p.texels == 0 ? n : std::min(p.least, n);
    p.unshaded += n == 0 ? 1 : 0;
    sum += n;
    ++p.texels;
  }
  if (p.texels > 0) p.mean = static_cast<float>(sum / p.texels);
  return p;
}

}  // namespace

TileProgress survey_tile(const atlas::RadianceStore& store, TileId tile, const TexelMask& mask,
                         const TileSurface& surface) {
  const auto view = store.read(tile);
  return progress_of(mask, surface, [&](int t) { return view ? view->count(Layer::kSoft, t) : 0.0f; });
}

Result<ShadingResult> shade_tile(atlas::RadianceStore& store, TileId tile, const TexelMask& mask, std::uint32_t passes,
                                 const TileSurface& surface, std::uint32_t most) {
  ShadingResult result;
  const auto view = store.read(tile);
  const auto count_of = [&](int t) { return view ? view->count(Layer::kSoft, t) : 0.0f; };
  const TileProgress before = progress_of(mask, surface, count_of);
  result.progress = before;
  if (before.texels == 0) return result;

  const auto goal = std::min(static_cast<std::uint32_t>(before.least) + passes, most);
  std::vector<TexelWork> work;
  for (int t = 0; t < kTileTexels; ++t) {
    if (!mask.test(t) || surface.patch(t) == kNobody) continue;
    const auto have = static_cast<std::uint32_t>(count_of(t));
    if (have >= goal) continue;
    TexelWork texel{t, {}, {}};
    for (std::uint32_t i = 0; i < std::min(passes, goal - have); ++i) {
      ++result.samples;
      if (!take_sample(surface, t, have + i, texel)) ++result.quarantined;
    }
    if (texel.soft.count > 0) work.push_back(texel);
  }
  if (work.empty()) return result;

  {
    auto update = store.begin_update(tile);
    if (!update) return std::unexpected(update.error());
    for (const auto& w : work) {
      update->merge(w.texel, Layer::kSharp, w.sharp);
      update->merge(w.texel, Layer::kSoft, w.soft);
    }
  }
  result.progress = survey_tile(store, tile, mask, surface);
  return result;
}

}  // namespace darm::renderer
