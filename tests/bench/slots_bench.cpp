// links: darm_daemon darm_client_core
// What few slots cost a still view, beside the limit: the same allocation with every loss known exactly. One process,
// no client: each tile of the view is lit (or taken from the store in STATE_DIR), every client sample is looked up.
//   slots_bench SETUP.toml SCENE CAMERA STATE_DIR Q SAMPLES REFERENCE
// SAMPLES a texel; REFERENCE.a.pfm and .b.pfm are halves made by `darmd render` at 1280x720. Prints one JSON object;
// loss_db is against the same picture with slots for all, by how chains are weighed: by the table (nothing known), by
// measure_losses() (what darmd serve does), exactly (all samples, all channels).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include "actors/tile_scheduler/texel_taps.hpp"
#include "actors/tile_scheduler/view_demand.hpp"
#include "actors/tile_scheduler/visibility.hpp"
#include "client/core/image_metrics.hpp"
#include "client/core/scene_model.hpp"
#include "tests/bench/lit_view.hpp"

namespace {

using namespace darm;
using namespace darm::bench;
using namespace darm::tile_scheduler;

constexpr std::size_t kSamplesPerPixel = kClientSamples.size();
constexpr std::uint32_t kSky = ChainIndex::kAbsent;

// Where one client sample looks: the slot of each position of its chain, then that of the coarse level.
struct Look {
  std::uint32_t chain = kSky;
  std::array<TileId, kChainLength + 1> tiles{};
  std::array<glm::vec2, kChainLength + 1> at{};
};

struct View : LitView {
  std::vector<Look> looks;  // kSamplesPerPixel a pixel
};

void trace_looks(View& view) {
  const auto& layout = *view.world.layout;
  ChainIndex numbers;
  for (const auto& c : view.chains) numbers.insert(c.chain);
  view.looks.resize(std::size_t{kViewport.width} * kViewport.height * kSamplesPerPixel);
  const ViewSampler sampler(layout, *view.world.rays, view.camera, kViewport);
  const auto look = [&](const SurfaceSample& sample, Look& out) {
    out.chain = numbers.find(chain_of(layout, sample));
    for (int i = 0; i <= kChainLength; ++i) {
      const int level = i == kChainLength ? layout.coarse_level() : std::min(sample.level + i, layout.coarse_level());
      const auto texel = layout.texel_at(sample.patch, level, sample.uv);
      const auto tile = tile_holding(layout, level, texel);
      const auto across = layout.levels[static_cast<std::size_t>(level)].tiles_x;
      out.tiles[static_cast<std::size_t>(i)] = tile;
      out.at[static_cast<std::size_t>(i)] =
          texel - glm::vec2(tile.index() % across, tile.index() / across) * float{kTileSize} + 1.0f;
    }
  };
  atlas::parallel_for(kViewport.height, kThreads, [&](std::size_t y) {
    std::array<SurfaceSample, kMaxLayers> surfaces;
    for (std::size_t x = 0; x < kViewport.width; ++x)
      for (std::size_t k = 0; k < kSamplesPerPixel; ++k)
        if (sampler.trace(static_cast<float>(x) + kClientSamples[k].x, static_cast<float>(y) + kClientSamples[k].y,
                          surfaces) > 0)
          look(surfaces[0], view.looks[(y * kViewport.width + x) * kSamplesPerPixel + k]);
  });
}

CoarseLuma coarse_luma(const View& view) {
  const int number = view.world.layout->coarse_level();
  const auto& level = view.world.layout->levels[static_cast<std::size_t>(number)];
  CoarseLuma out{level.width, level.height, std::vector<std::uint8_t>(std::size_t{level.width} * level.height)};
  for (std::size_t y = 0; y < level.height; ++y)
    for (std::size_t x = 0; x < level.width; ++x) {
      const auto index = static_cast<std::uint32_t>(y / kTileSize * level.tiles_x + x / kTileSize);
      if (const auto* stored = view.images.find(TileId(number, index)))
        out.luma[y * level.width + x] = stored->image->y[(y % kTileSize + 1) * kSlotSize + x % kTileSize + 1];
    }
  return out;
}

// Colour of a look at position `position` or the next coarser one with a picture, display RGB 0..1.
glm::vec3 colour(const View& view, const Look& look, std::size_t position) {
  const StoredImage* stored = view.images.find(look.tiles[position]);
  while (stored == nullptr && position < kChainLength) stored = view.images.find(look.tiles[++position]);
  if (stored == nullptr) return glm::vec3(0.5f);
  const glm::vec2 at = glm::clamp(look.at[position] - 0.5f, 0.0f, float{kSlotSize - 1});
  const int x = std::min(static_cast<int>(at.x), kSlotSize - 2), y = std::min(static_cast<int>(at.y), kSlotSize - 2);
  const glm::vec2 w = at - glm::vec2(x, y);
  const auto texel = [&](int dx, int dy) {
    const auto* p = &stored->image->rgb[static_cast<std::size_t>(((y + dy) * kSlotSize + x + dx) * 3)];
    return glm::vec3(p[0], p[1], p[2]) / 255.0f;
  };
  return glm::mix(glm::mix(texel(0, 0), texel(1, 0), w.x), glm::mix(texel(0, 1), texel(1, 1), w.x), w.y);
}

// The client's picture; `served` per chain, null: all sharp. Pixels that show sky come from the reference.
client::Image8 picture(const View& view, const std::vector<std::uint8_t>* served, const client::Reference& reference) {
  client::Image8 out{kViewport.width, kViewport.height, {}};
  out.rgb.resize(std::size_t{kViewport.width} * kViewport.height * 3);
  atlas::parallel_for(out.rgb.size() / 3, kThreads, [&](std::size_t pixel) {
    glm::dvec3 sum(0.0);
    bool sky = false;
    for (std::size_t k = 0; k < kSamplesPerPixel; ++k) {
      const auto& look = view.looks[pixel * kSamplesPerPixel + k];
      sky = sky || look.chain == kSky;
      if (sky) break;
      const auto c = colour(view, look, served == nullptr ? 0 : (*served)[look.chain]);
      for (int i = 0; i < 3; ++i)
        sum[i] += double(c[i] <= 0.04045f ? c[i] / 12.92f : std::pow((c[i] + 0.055f) / 1.055f, 2.4f));
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const double light = sky ? 0.5 * double(reference.a.rgb[pixel * 3 + i] + reference.b.rgb[pixel * 3 + i])
                               : sum[static_cast<int>(i)] / double(kSamplesPerPixel);
      out.rgb[pixel * 3 + i] = static_cast<std::uint8_t>(
          std::lround(255 * client::linear_to_srgb(static_cast<float>(std::clamp(light, 0.0, 1.0)))));
    }
  });
  return out;
}

// Mean squared difference of each chain's samples to the sharp picture, over all samples and channels.
std::vector<ChainLoss> exact_losses(const View& view) {
  std::vector<std::array<double, kChainLength + 1>> sums(view.chains.size());
  std::vector<double> count(view.chains.size(), 0.0);
  for (const auto& look : view.looks) {
    if (look.chain == kSky) continue;
    const auto sharp = colour(view, look, 0);
    count[look.chain] += 1;
    for (std::size_t i = 1; i <= kChainLength; ++i) {
      const auto d = colour(view, look, i) - sharp;
      sums[look.chain][i] += double(d.x * d.x + d.y * d.y + d.z * d.z);
    }
  }
  std::vector<ChainLoss> out(view.chains.size(), ChainLoss{});
  for (std::size_t c = 0; c < out.size(); ++c)
    for (std::size_t i = 1; i <= kChainLength; ++i)
      out[c][i] = std::max(out[c][i - 1], static_cast<float>(count[c] > 0 ? sums[c][i] / count[c] : 0.0));
  return out;
}

double milliseconds_of_thread() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) * 1e3 + double(t.tv_nsec) * 1e-6;
}

Result<void> report(View& view, const std::string& camera, const client::Reference& reference) {
  const auto full = client::compare(picture(view, nullptr, reference), reference);
  if (!full) return fail(full.error().message);
  TileIndex sharp;
  for (const auto& c : view.chains) sharp.insert(c.chain.tiles[0]);
  std::printf("{\"camera\": \"%s\", \"q\": %g, \"psnr\": %.2f, \"sharp_tiles\": %zu, \"chains\": %zu", camera.c_str(),
              double(view.world.layout->q), full->psnr, sharp.size(), view.chains.size());
  const auto luma = coarse_luma(view);
  const double begin = milliseconds_of_thread();
  const auto measured = measure_losses(
      view.chains, view.set.current().taps(), [&](TileId t) { return view.images.find(t); }, &luma,
      view.world.layout->coarse_level());
  std::printf(", \"measure_ms\": %.1f", milliseconds_of_thread() - begin);
  const auto exact = exact_losses(view);
  for (const std::size_t slots : {std::size_t{4096}, std::size_t{1024}}) {
    std::printf(", \"slots_%zu\": {", slots);
    const std::vector<ChainLoss> nothing;
    for (const auto& [name, losses] : {std::pair{"table", &nothing}, {"measured", &measured}, {"exact", &exact}}) {
      AllocationRequest request;
      request.chains = view.chains;
      request.losses = *losses;
      request.slots = slots;
      request.coarse_level = view.world.layout->coarse_level();
      const double start = milliseconds_of_thread();
      const auto allocation = allocate_slots(request);
      const double spent = milliseconds_of_thread() - start;
      const auto score = client::compare(picture(view, &allocation.served, reference), reference);
      if (!score) return fail(score.error().message);
      std::printf("%s\"%s\": {\"loss_db\": %.2f, \"allocate_ms\": %.1f}", losses == &nothing ? "" : ", ", name,
                  full->psnr - score->psnr, spent);
    }
    std::printf("}");
  }
  std::printf("}\n");
  return {};
}

Result<void> run(char** argv) {
  auto a = client::read_pfm(std::string(argv[7]) + ".a.pfm");
  auto b = client::read_pfm(std::string(argv[7]) + ".b.pfm");
  if (!a || !b) return fail(std::string(argv[7]) + ": its halves cannot be read: " + (a ? b : a).error().message);
  if (a->width != kViewport.width || a->height != kViewport.height || b->rgb.size() != a->rgb.size())
    return fail(std::string(argv[7]) + ": is not 1280x720");
  View view;
  if (auto opened = open_view(view, argv[1], argv[2], argv[3], argv[4], std::strtod(argv[5], nullptr)); !opened)
    return opened;
  trace_looks(view);
  auto masks = wanted_texels(view);
  for (const auto& l : view.looks)
    if (l.chain != kSky) masks[l.tiles[kChainLength]] = TexelMask::all();
  light(view, masks, static_cast<std::uint32_t>(std::strtoul(argv[6], nullptr, 10)));
  return report(view, argv[3], {std::move(*a), std::move(*b)});
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 8) {
    std::fprintf(stderr, "usage: %s SETUP.toml SCENE CAMERA STATE_DIR Q SAMPLES REFERENCE\n", argv[0]);
    return 2;
  }
  if (const auto done = run(argv); !done) {
    std::fprintf(stderr, "%s\n", done.error().message.c_str());
    return 1;
  }
  return 0;
}
