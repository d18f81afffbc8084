#include "actors/tile_scheduler/view_report.hpp"

#include <algorithm>
#include <atomic>
#include <thread>
#include <unordered_map>
#include <vector>

#include "actors/tile_scheduler/texel_taps.hpp"
#include "actors/tile_scheduler/visibility.hpp"
#include "actors/types/texel_mask.hpp"

namespace darm::tile_scheduler {
namespace {

struct SeenTile {
  TexelMask texels;
  bool holds_sample = false;
};
using SeenTiles = std::unordered_map<TileId, SeenTile>;

void note(const atlas::Layout& layout, const SurfaceSample& sample, SeenTiles& seen) {
  const auto& level = layout.levels[static_cast<std::size_t>(sample.level)];
  const auto texel = layout.texel_at(sample.patch, sample.level, sample.uv);
  seen[tile_holding(layout, sample.level, texel)].holds_sample = true;
  for_each_tile_part(level, sample.level, taps_at(level, texel), [&](TileId tile, const TexelBox& part) {
    auto& texels = seen[tile].texels;
    for (int y = part.y0; y <= part.y1; ++y)
      for (int x = part.x0; x <= part.x1; ++x) texels.set(x, y);
  });
}

}  // namespace

void for_each_client_sample(const atlas::Layout& layout, const renderer::trace::RayScene& rays, const Camera& camera,
                            const Viewport& viewport, unsigned threads,
                            const std::function<void(unsigned, const SurfaceSample&, float)>& visit) {
  const ViewSampler sampler(layout, rays, camera, viewport);
  const float weight = 1.0f / (static_cast<float>(kClientSamples.size()) * static_cast<float>(viewport.width) *
                               static_cast<float>(viewport.height));
  std::atomic<std::uint32_t> next_row{0};
  const auto work = [&](unsigned thread) {
    const renderer::trace::DenormalsAreZero denormals;
    std::array<SurfaceSample, kMaxLayers> surfaces;
    for (std::uint32_t y = next_row++; y < viewport.height; y = next_row++)
      for (std::uint32_t x = 0; x < viewport.width; ++x)
        for (const auto& s : kClientSamples) {
          const int layers = sampler.trace(static_cast<float>(x) + s.x, static_cast<float>(y) + s.y, surfaces);
          for (int i = 0; i < layers; ++i) visit(thread, surfaces[static_cast<std::size_t>(i)], weight);
        }
  };
  std::vector<std::jthread> others;
  for (unsigned t = 1; t < threads; ++t) others.emplace_back(work, t);
  work(0);
}

ViewReport report_view(const atlas::Layout& layout, const renderer::trace::RayScene& rays, const Camera& camera,
                       const Viewport& viewport, unsigned threads) {
  threads = std::max(1u, threads);
  std::vector<SeenTiles> seen(threads);
  std::vector<double> weight(threads, 0.0);
  for_each_client_sample(layout, rays, camera, viewport, threads,
                         [&](unsigned thread, const SurfaceSample& sample, float w) {
                           note(layout, sample, seen[thread]);
                           weight[thread] += double(w);
                         });
  ViewReport report;
  for (unsigned t = 1; t < threads; ++t)
    for (const auto& [tile, theirs] : seen[t]) {
      auto& mine = seen[0][tile];
      mine.texels |= theirs.texels;
      mine.holds_sample = mine.holds_sample || theirs.holds_sample;
    }
  for (const auto& [tile, what] : seen[0]) {
    report.visible_texels += static_cast<std::uint64_t>(what.texels.count());
    report.visible_tiles += what.holds_sample ? 1u : 0u;
  }
  for (const double w : weight) report.covered += w;
  if (report.visible_tiles > 0)
    report.efficiency = double(report.visible_texels) / (double(kTileTexels) * double(report.visible_tiles));
  return report;
}

}  // namespace darm::tile_scheduler
