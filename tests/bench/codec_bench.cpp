// links: darm_daemon darm_client_core darm_encoder
// The PhysTex picture of a still view after the codec, against before: the tiles that `darmd serve` would hold, as lit
// in the store in STATE_DIR, through the configured encoder and the client's decoder.
//   codec_bench SETUP.toml SCENE CAMERA STATE_DIR Q [SAMPLES]
// SAMPLES: brings each texel to that many first (0, unless given: what the store has). Prints one JSON object. PSNR
// over the slots in use: `rgb` against the tiles' own 4:4:4 colours, so that it holds the loss of 4:2:0 chroma
// (bilinear, as a client samples it); `y`, `cb`, `cr` against the planes that went in. `key`: the first picture;
// `settled`: the same picture again, as P-frames, after `frames` of them.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "actors/encoder/phystex_picture.hpp"
#include "actors/tile_scheduler/slot_allocation.hpp"
#include "client/core/video_decoder.hpp"
#include "tests/bench/lit_view.hpp"

namespace {

using namespace darm;
using namespace darm::bench;

constexpr std::uint32_t kPhysTex = 2048;
constexpr int kFrames = 10;

struct Score {
  double rgb = 0, y = 0, cb = 0, cr = 0;
};

double psnr(double squares, double count) { return 10.0 * std::log10(255.0 * 255.0 * count / std::max(squares, 1e-9)); }

// Chroma of a slot at a texel, bilinear between centre-sited samples, never across the slot's edge.
float chroma_at(const std::uint8_t* slot, std::size_t stride, int x, int y) {
  const auto place = [](int texel, int& first) {
    const float at = std::clamp((static_cast<float>(texel) - 0.5f) * 0.5f, 0.0f, float{kSlotSize / 2 - 1});
    first = std::min(static_cast<int>(at), kSlotSize / 2 - 2);
    return at - static_cast<float>(first);
  };
  int i = 0, j = 0;
  const float u = place(x, i), v = place(y, j);
  const auto* p = slot + static_cast<std::size_t>(j) * stride + i;
  return std::lerp(std::lerp(float(p[0]), float(p[1]), u), std::lerp(float(p[stride]), float(p[stride + 1]), u), v);
}

double rgb_squares(const client::Picture& out, std::size_t slot, const TileImage& image) {
  const std::size_t across = kPhysTex / kSlotSize, half = kSlotSize / 2;
  const std::size_t x0 = slot % across * kSlotSize, y0 = slot / across * kSlotSize;
  const std::size_t stride = out.chroma_width(), chroma = slot / across * half * stride + slot % across * half;
  double squares = 0;
  for (int y = 0; y < kSlotSize; ++y)
    for (int x = 0; x < kSlotSize; ++x) {
      const float luma = out.y[(y0 + static_cast<std::size_t>(y)) * out.width + x0 + static_cast<std::size_t>(x)];
      const float cb = chroma_at(&out.cb[chroma], stride, x, y) - 128.0f;
      const float cr = chroma_at(&out.cr[chroma], stride, x, y) - 128.0f;
      const float rgb[3] = {luma + 1.5748f * cr, luma - 0.187324f * cb - 0.468124f * cr, luma + 1.8556f * cb};
      for (int c = 0; c < 3; ++c) {
        const double d = double(std::clamp(rgb[c], 0.0f, 255.0f)) -
                         double(image.rgb[static_cast<std::size_t>((y * kSlotSize + x) * 3 + c)]);
        squares += d * d;
      }
    }
  return squares;
}

template <std::size_t N>
double plane_squares(const std::vector<std::uint8_t>& out, std::size_t slot, const std::array<std::uint8_t, N>& in) {
  const std::size_t side = N == kSlotTexels ? kSlotSize : kSlotSize / 2, across = kPhysTex / kSlotSize;
  double squares = 0;
  for (std::size_t y = 0; y < side; ++y)
    for (std::size_t x = 0; x < side; ++x) {
      const double d =
          double(out[(slot / across * side + y) * across * side + slot % across * side + x]) - double(in[y * side + x]);
      squares += d * d;
    }
  return squares;
}

Score score(const client::Picture& out, const std::vector<const TileImage*>& tiles) {
  Score sums;
  for (std::size_t slot = 0; slot < tiles.size(); ++slot) {
    sums.rgb += rgb_squares(out, slot, *tiles[slot]);
    sums.y += plane_squares(out.y, slot, tiles[slot]->y);
    sums.cb += plane_squares(out.cb, slot, tiles[slot]->cb);
    sums.cr += plane_squares(out.cr, slot, tiles[slot]->cr);
  }
  const double texels = double(tiles.size()) * kSlotTexels;
  return {psnr(sums.rgb, texels * 3), psnr(sums.y, texels), psnr(sums.cb, texels / 4), psnr(sums.cr, texels / 4)};
}

std::vector<const TileImage*> held_tiles(const LitView& view) {
  tile_scheduler::AllocationRequest request;
  request.chains = view.chains;
  request.available = [&](TileId tile) { return view.images.find(tile) != nullptr; };
  request.slots = std::size_t{kPhysTex / kSlotSize} * (kPhysTex / kSlotSize);
  request.coarse_level = view.world.layout->coarse_level();
  std::vector<const TileImage*> tiles;
  for (const auto tile : allocate_slots(request).tiles) tiles.push_back(view.images.find(tile)->image.get());
  return tiles;
}

Result<void> report(const LitView& view, const char* camera) {
  const auto tiles = held_tiles(view);
  if (tiles.empty()) return fail("no tile of this view is lit: give SAMPLES, or a STATE_DIR that has served it");
  encoder::PhysTexPicture phystex(kPhysTex, false);
  for (std::size_t slot = 0; slot < tiles.size(); ++slot) phystex.write(static_cast<SlotIndex>(slot), *tiles[slot]);
  const auto& stream = view.config.stream;
  auto coder = encoder::H264Encoder::create(
      {.width = kPhysTex, .height = kPhysTex, .crf = static_cast<float>(stream.crf), .preset = stream.preset});
  if (!coder) return std::unexpected(coder.error());
  auto decoder = client::VideoDecoder::create(kPhysTex, kPhysTex);
  if (!decoder) return fail(decoder.error().message);
  std::size_t bytes[2] = {0, 0};
  Score scores[2];
  client::Picture out;
  for (int frame = 0; frame <= kFrames; ++frame) {
    const auto packet = (*coder)->encode(phystex.view(), frame == 0);
    if (!packet) return std::unexpected(packet.error());
    if (const auto done = decoder->decode(*packet, out); !done) return fail(done.error().message);
    const int kind = frame == 0 ? 0 : 1;
    bytes[kind] += packet->size();
    scores[kind] = score(out, tiles);
  }
  std::printf("{\"camera\": \"%s\", \"q\": %g, \"tiles\": %zu, \"crf\": %u, \"frames\": %d", camera,
              double(view.world.layout->q), tiles.size(), stream.crf, kFrames);
  for (int kind = 0; kind < 2; ++kind)
    std::printf(", \"%s\": {\"bytes\": %zu, \"rgb\": %.2f, \"y\": %.2f, \"cb\": %.2f, \"cr\": %.2f}",
                kind == 0 ? "key" : "settled", bytes[kind], scores[kind].rgb, scores[kind].y, scores[kind].cb,
                scores[kind].cr);
  std::printf("}\n");
  return {};
}

Result<void> run(int argc, char** argv) {
  LitView view;
  if (auto opened = open_view(view, argv[1], argv[2], argv[3], argv[4], std::strtod(argv[5], nullptr)); !opened)
    return opened;
  light(view, wanted_texels(view), argc > 6 ? static_cast<std::uint32_t>(std::strtoul(argv[6], nullptr, 10)) : 0);
  return report(view, argv[3]);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6 && argc != 7) {
    std::fprintf(stderr, "usage: %s SETUP.toml SCENE CAMERA STATE_DIR Q [SAMPLES]\n", argv[0]);
    return 2;
  }
  if (const auto done = run(argc, argv); !done) {
    std::fprintf(stderr, "%s\n", done.error().message.c_str());
    return 1;
  }
  return 0;
}
