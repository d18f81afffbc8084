#include "daemon/accuracy/software_view.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numeric>

#include "actors/atlas/parallel.hpp"
#include "actors/tile_scheduler/texel_taps.hpp"
#include "actors/tile_scheduler/view_sampler.hpp"
#include "actors/tile_scheduler/visibility.hpp"

namespace darm::accuracy {
namespace {

constexpr std::size_t kSamples = tile_scheduler::kClientSamples.size();
constexpr std::size_t kCurveSteps = 4096;  // finer than half a code of the display everywhere

// sRGB to linear by table: pow for each of eleven million channels would be most of drawing.
float to_linear(float display) {
  static const auto table = [] {
    std::array<float, kCurveSteps + 1> out{};
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double x = std::min((static_cast<double>(i) + 0.5) / kCurveSteps, 1.0);  // the middle of its step
      out[i] = static_cast<float>(x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4));
    }
    return out;
  }();
  return table[static_cast<std::size_t>(std::clamp(display, 0.0f, 1.0f) * float{kCurveSteps})];
}

bool is_seen_through(const renderer::trace::RayScene& rays, std::uint32_t instance) {
  const auto& material = *rays.instance(instance).material;
  return material.alpha_mode == scene::AlphaMode::kBlend || material.transmission > 0;
}

}  // namespace

double counted_share(const PixelMask& mask) {
  if (mask.empty()) return 0;
  return std::accumulate(mask.begin(), mask.end(), 0.0) / static_cast<double>(mask.size());
}

SoftwareView::SoftwareView(const atlas::Layout& layout, const renderer::trace::RayScene& rays, const Camera& camera,
                           const Viewport& viewport, unsigned threads)
    : layout_(layout),
      viewport_(viewport),
      looks_(std::size_t{viewport.width} * viewport.height * kSamples),
      counted_(std::size_t{viewport.width} * viewport.height, 0) {
  const tile_scheduler::ViewSampler sampler(layout, rays, camera, viewport);
  atlas::parallel_for(viewport.height, threads, [&](std::size_t y) {
    const renderer::trace::DenormalsAreZero denormals;
    std::array<tile_scheduler::SurfaceSample, tile_scheduler::kMaxLayers> surfaces;
    for (std::size_t x = 0; x < viewport_.width; ++x) {
      const std::size_t pixel = y * viewport_.width + x;
      std::size_t opaque = 0;
      for (std::size_t k = 0; k < kSamples; ++k) {
        const auto& offset = tile_scheduler::kClientSamples[k];
        if (sampler.trace(static_cast<float>(x) + offset.x, static_cast<float>(y) + offset.y, surfaces) == 0) break;
        if (is_seen_through(rays, surfaces[0].instance)) break;
        looks_[pixel * kSamples + k] = {index_of(surfaces[0].patch), surfaces[0].level, surfaces[0].uv};
        ++opaque;
      }
      counted_[pixel] = opaque == kSamples ? 1 : 0;
    }
  });
}

SoftwareView::Found SoftwareView::find(const Look& look, const ClientState& state) const {
  const PatchId patch{look.patch};
  for (int i = 0; i <= kMaxCoarserLevels && look.level + i <= layout_.coarse_level(); ++i) {
    const int level = look.level + i;
    const auto texel = layout_.texel_at(patch, level, look.uv);
    const auto tile = tile_scheduler::tile_holding(layout_, level, texel);
    if (const auto slot = state.slot_of(tile); slot != kNoSlot) return {slot, tile, texel};
  }
  return {};
}

glm::vec3 SoftwareView::colour(const Look& look, const ClientState& state) const {
  const auto [slot, tile, texel] = find(look, state);
  if (slot == kNoSlot)
    return state.coarse_colour(layout_.texel_at(PatchId{look.patch}, layout_.coarse_level(), look.uv));
  const auto across = layout_.levels[static_cast<std::size_t>(tile.level())].tiles_x;
  const glm::vec2 corner(tile.index() % across, tile.index() / across);
  return state.slot_colour(slot, texel - corner * float{kTileSize} + 1.0f);
}

double SoftwareView::share_of_tiles(const ClientState& state, unsigned threads) const {
  std::atomic<std::size_t> from_tiles{0}, all{0};
  atlas::parallel_for(viewport_.height, threads, [&](std::size_t y) {
    std::size_t found = 0, looked = 0;
    for (std::size_t pixel = y * viewport_.width; pixel < (y + 1) * viewport_.width; ++pixel) {
      if (counted_[pixel] == 0) continue;
      for (std::size_t k = 0; k < kSamples; ++k, ++looked)
        found += find(looks_[pixel * kSamples + k], state).slot != kNoSlot ? 1u : 0u;
    }
    from_tiles += found;
    all += looked;
  });
  return all > 0 ? static_cast<double>(from_tiles) / static_cast<double>(all) : 0;
}

renderer::Picture SoftwareView::draw(const ClientState& state, unsigned threads) const {
  renderer::Picture out{viewport_.width, viewport_.height, {}};
  out.pixels.resize(counted_.size(), glm::vec3(0.0f));
  atlas::parallel_for(viewport_.height, threads, [&](std::size_t y) {
    for (std::size_t pixel = y * viewport_.width; pixel < (y + 1) * viewport_.width; ++pixel) {
      if (counted_[pixel] == 0) continue;
      glm::vec3 sum(0.0f);
      for (std::size_t k = 0; k < kSamples; ++k) {
        const auto c = colour(looks_[pixel * kSamples + k], state);
        sum += glm::vec3(to_linear(c.x), to_linear(c.y), to_linear(c.z));
      }
      out.pixels[pixel] = sum / float{kSamples};
    }
  });
  return out;
}

}  // namespace darm::accuracy
