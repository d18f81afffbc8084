// links: darm_encoder PkgConfig::LIBAV_BENCH
// Composition and encoding of a 2048x2048 PhysTex at 10 updates a second, beside memcpy of the same bytes, and how the
// picture comes back. Tiles carry texture at several scales plus the noise of path tracing, which falls with time.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>
#include <vector>

#include "actors/encoder/h264_encoder.hpp"
#include "actors/encoder/phystex_picture.hpp"
#include "tests/unit/encoder/decode.hpp"

using namespace darm;
using namespace darm::encoder;

namespace {

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point t) { return std::chrono::duration<double, std::milli>(Clock::now() - t).count(); }

// A tile of smoothed value noise in three octaves; `sigma`: noise of the light, in levels.
TileImage make_tile(std::uint32_t seed, float sigma, std::mt19937& noise) {
  std::minstd_rand pick(seed + 1);
  const auto unit = [&] { return static_cast<float>(pick() % 10000) / 10000.0f; };
  const float base[3] = {60 + 130 * unit(), 60 + 130 * unit(), 60 + 130 * unit()};
  float grid[3][9][9];
  for (auto& octave : grid)
    for (auto& row : octave)
      for (auto& v : row) v = unit() - 0.5f;
  std::normal_distribution<float> light(0.0f, std::max(sigma, 1e-6f));
  TileImage t;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      float texture = 0;
      for (int o = 0; o < 3; ++o) {
        const float cell = static_cast<float>(32 >> (o + 1));
        const float fx = static_cast<float>(x) / cell, fy = static_cast<float>(y) / cell;
        const int ix = static_cast<int>(fx) % 8, iy = static_cast<int>(fy) % 8;
        const float u = fx - std::floor(fx), v = fy - std::floor(fy);
        const auto& g = grid[o];
        texture += (g[iy][ix] * (1 - u) * (1 - v) + g[iy][ix + 1] * u * (1 - v) + g[iy + 1][ix] * (1 - u) * v +
                    g[iy + 1][ix + 1] * u * v) *
                   40.0f / static_cast<float>(o + 1);
      }
      const float n = light(noise);
      for (int c = 0; c < 3; ++c) {
        const float value = std::clamp(base[c] + texture + n + 0.3f * light(noise), 0.0f, 255.0f);
        t.rgb[static_cast<std::size_t>((y * 32 + x) * 3 + c)] = static_cast<std::uint8_t>(value);
      }
    }
  }
  const auto at = [&](int x, int y, int c) {
    return static_cast<int>(t.rgb[static_cast<std::size_t>((y * 32 + x) * 3 + c)]);
  };
  for (int y = 0; y < 32; y += 2) {
    for (int x = 0; x < 32; x += 2) {
      int sum[3] = {2, 2, 2};
      for (int k = 0; k < 4; ++k) {
        const int px = x + (k & 1), py = y + (k >> 1);
        for (int c = 0; c < 3; ++c) sum[c] += at(px, py, c);
        t.y[static_cast<std::size_t>(py * 32 + px)] = to_ycc(at(px, py, 0), at(px, py, 1), at(px, py, 2)).y;
      }
      const auto mean = to_ycc(sum[0] / 4, sum[1] / 4, sum[2] / 4);
      t.cb[static_cast<std::size_t>(y / 2 * 16 + x / 2)] = mean.cb;
      t.cr[static_cast<std::size_t>(y / 2 * 16 + x / 2)] = mean.cr;
    }
  }
  return t;
}

struct Psnr {
  double luma, all;
};
Psnr psnr(const encoder::testing::DecodedPicture& got, const PlanarPicture& want) {
  double luma = 0, sum = 0, count = 0;
  for (int i = 0; i < 3; ++i) {
    double plane = 0;
    for (int y = 0; y < got.plane_height[i]; ++y) {
      for (int x = 0; x < got.plane_width[i]; ++x) {
        const double d = double(got.plane[i][static_cast<std::size_t>(y * got.plane_width[i] + x)]) -
                         want.plane[i][static_cast<std::size_t>(y) * want.stride[i] + static_cast<std::size_t>(x)];
        plane += d * d;
      }
    }
    const double n = double(got.plane_width[i]) * got.plane_height[i];
    if (i == 0) luma = plane / n;
    sum += plane;
    count += n;
  }
  const auto db = [](double mse) { return 10 * std::log10(255.0 * 255.0 / std::max(mse, 1e-9)); };
  return {db(luma), db(sum / count)};
}

struct Stats {
  std::vector<double> values;
  void add(double v) { values.push_back(v); }
  double mean() const {
    double s = 0;
    for (const auto v : values) s += v;
    return s / static_cast<double>(values.size());
  }
  double p99() {
    std::sort(values.begin(), values.end());
    return values[(values.size() - 1) * 99 / 100];
  }
};

}  // namespace

int main(int argc, char** argv) {
  const bool json = argc > 1 && std::strcmp(argv[1], "--json") == 0;
  H264Settings settings;
  settings.width = settings.height = 2048;
  if (const char* preset = std::getenv("DARM_BENCH_PRESET")) settings.preset = preset;
  if (const char* crf = std::getenv("DARM_BENCH_CRF")) settings.crf = static_cast<float>(std::atof(crf));
  auto codec = H264Encoder::create(settings).value();
  PhysTexPicture picture(2048, false);
  std::mt19937 noise(7);
  encoder::testing::Decoder decoder;
  Stats compose, copy, encode, bytes;
  double first_luma = 0, first_all = 0, worst = 1e9, still = 0, key_bytes = 0, key_ms = 0;
  std::vector<std::uint8_t> flat(2048 * 2048 * 3 / 2);
  constexpr int kFrames = 60, kChanged = 700;
  std::uint32_t next = 0;
  for (int f = 0; f < kFrames + 10; ++f) {
    const int changed = f == 0 ? 4096 : (f < kFrames ? kChanged : 0);
    const float sigma = 8.0f / std::sqrt(1.0f + static_cast<float>(f));
    std::vector<std::pair<SlotIndex, TileImage>> tiles;
    for (int i = 0; i < changed; ++i, next = (next + 1) % 4096) {
      const auto slot = static_cast<SlotIndex>(next * 2654435761u % 4096u);
      tiles.emplace_back(slot, make_tile(slot, sigma, noise));
    }
    auto t = Clock::now();
    for (const auto& [slot, tile] : tiles) picture.write(slot, tile);
    const double compose_ms = ms_since(t);
    t = Clock::now();
    std::size_t at = 0;
    for (const auto& [slot, tile] : tiles) {
      std::memcpy(flat.data() + at, tile.y.data(), 1024);
      std::memcpy(flat.data() + at + 1024, tile.cb.data(), 256);
      std::memcpy(flat.data() + at + 1280, tile.cr.data(), 256);
      at += 1536;
    }
    const double copy_ms = ms_since(t);
    t = Clock::now();
    const auto packet = codec->encode(picture.view(), f == 0).value();
    const double encode_ms = ms_since(t);
    const auto quality = psnr(decoder.decode(packet), picture.view());
    if (f == 0) {
      first_luma = quality.luma;
      first_all = quality.all;
      key_bytes = static_cast<double>(packet.size());
      key_ms = encode_ms;
      std::fprintf(stderr, "all 4096 slots composed in %.2f ms\n", compose_ms);
    } else if (f < kFrames) {
      compose.add(compose_ms);
      copy.add(copy_ms);
      encode.add(encode_ms);
      bytes.add(static_cast<double>(packet.size()));
    }
    worst = std::min(worst, quality.all);
    still = quality.all;
  }
  const char* format =
      json ? "{\"changed_slots\":%d,\"compose_ms\":{\"mean\":%.3f,\"p99\":%.3f},\"memcpy_ms\":%.3f,"
             "\"encode_ms\":{\"mean\":%.1f,\"p99\":%.1f,\"key\":%.1f},\"bytes\":{\"mean\":%.0f,\"key\":%.0f},"
             "\"psnr\":{\"first_luma\":%.2f,\"first\":%.2f,\"worst\":%.2f,\"still\":%.2f}}\n"
           : "%d slots changed a frame: compose %.3f ms mean, %.3f p99 (memcpy %.3f); encode %.1f ms mean, %.1f p99, "
             "key %.1f; bytes %.0f mean, key %.0f; PSNR first luma %.2f, first %.2f, worst %.2f, still %.2f dB\n";
  std::printf(format, kChanged, compose.mean(), compose.p99(), copy.mean(), encode.mean(), encode.p99(), key_ms,
              bytes.mean(), key_bytes, first_luma, first_all, worst, still);
  return 0;
}
