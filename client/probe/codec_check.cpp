#include "client/probe/codec_check.hpp"

#include <algorithm>
#include <cmath>

namespace darm::client::probe {
namespace {

constexpr std::uint32_t kSlot = 32;

std::uint8_t to_byte(double value) { return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L)); }

// Full-range BT.709, chroma averaged over 2x2.
SlotPlanes planes_of(const std::string& rgb) {
  SlotPlanes planes{};
  std::array<double, 256> cb{}, cr{};
  for (std::uint32_t i = 0; i < kSlot * kSlot; ++i) {
    const auto byte = [&](std::uint32_t c) { return static_cast<double>(static_cast<std::uint8_t>(rgb[3 * i + c])); };
    const double r = byte(0), g = byte(1), b = byte(2);
    const double y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    planes.y[i] = to_byte(y);
    const std::uint32_t quad = (i / kSlot / 2) * 16 + (i % kSlot) / 2;
    cb[quad] += 0.25 * (b - y) / 1.8556;
    cr[quad] += 0.25 * (r - y) / 1.5748;
  }
  for (std::size_t i = 0; i < 256; ++i) {
    planes.cb[i] = to_byte(cb[i] + 128.0);
    planes.cr[i] = to_byte(cr[i] + 128.0);
  }
  return planes;
}

std::uint8_t chroma_at(const Picture& picture, const std::vector<std::uint8_t>& plane, std::uint32_t x,
                       std::uint32_t y) {
  const std::size_t stride = picture.chroma_width();
  if (!picture.chroma_444) return plane[y * stride + x];
  const std::size_t at = 2 * y * stride + 2 * x;
  return to_byte(0.25 * (plane[at] + plane[at + 1] + plane[at + stride] + plane[at + stride + 1]));
}

template <class A>
double squares(const A& a, const A& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
    sum += d * d;
  }
  return sum;
}

}  // namespace

TilePlanes tiles_of(const Picture& phystex, const PageTable& pages, std::uint32_t entries) {
  TilePlanes tiles;
  const std::uint32_t per_row = phystex.width / kSlot;
  const std::uint32_t slots = per_row * (phystex.height / kSlot);
  for (std::uint32_t entry = 0; entry < entries; ++entry) {
    const std::uint32_t slot = pages.slot(entry);
    if (slot >= slots) continue;
    const std::uint32_t left = slot % per_row * kSlot, top = slot / per_row * kSlot;
    SlotPlanes planes{};
    for (std::uint32_t i = 0; i < 1024; ++i) {
      planes.y[i] = phystex.y[std::size_t{top + i / kSlot} * phystex.width + left + i % kSlot];
    }
    for (std::uint32_t i = 0; i < 256; ++i) {
      planes.cb[i] = chroma_at(phystex, phystex.cb, left / 2 + i % 16, top / 2 + i / 16);
      planes.cr[i] = chroma_at(phystex, phystex.cr, left / 2 + i % 16, top / 2 + i / 16);
    }
    tiles.emplace(entry, planes);
  }
  return tiles;
}

TilePlanes tiles_of(const std::unordered_map<std::uint16_t, std::string>& pixels, const PageTable& pages,
                    std::uint32_t entries) {
  TilePlanes tiles;
  for (std::uint32_t entry = 0; entry < entries; ++entry) {
    const auto found = pixels.find(pages.slot(entry));
    if (pages.slot(entry) == kAbsent || found == pixels.end()) continue;
    tiles.emplace(entry, planes_of(found->second));
  }
  return tiles;
}

std::optional<CodecScore> compare_tiles(const TilePlanes& coded, const TilePlanes& lossless) {
  CodecScore score;
  double sum = 0;
  for (const auto& [entry, planes] : coded) {
    const auto other = lossless.find(entry);
    if (other == lossless.end()) continue;
    sum += squares(planes.y, other->second.y) + squares(planes.cb, other->second.cb) +
           squares(planes.cr, other->second.cr);
    ++score.tiles;
  }
  if (score.tiles == 0) return std::nullopt;
  const double mse = std::max(sum / (1536.0 * static_cast<double>(score.tiles)), 1e-6);
  score.psnr = 10.0 * std::log10(255.0 * 255.0 / mse);
  return score;
}

}  // namespace darm::client::probe
