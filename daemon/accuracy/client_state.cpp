#include "daemon/accuracy/client_state.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

namespace darm::accuracy {
namespace {

void copy_plane(const std::uint8_t* from, std::size_t stride, std::uint32_t width, std::uint32_t height,
                std::vector<std::uint8_t>& out) {
  out.resize(std::size_t{width} * height);
  for (std::uint32_t row = 0; row < height; ++row)
    std::copy_n(from + std::size_t{row} * stride, width, out.begin() + static_cast<std::ptrdiff_t>(row) * width);
}

// Four taps around `at` (texel centres at halves) within the box [low, high) of a plane.
float bilinear(const std::vector<std::uint8_t>& plane, std::uint32_t stride, glm::vec2 at, glm::ivec2 low,
               glm::ivec2 high) {
  const glm::vec2 p = glm::clamp(at - 0.5f, glm::vec2(low), glm::vec2(high - 1));
  const glm::ivec2 a(p), b = glm::min(a + 1, high - 1);
  const glm::vec2 w = p - glm::vec2(a);
  const auto value = [&](int x, int y) {
    return static_cast<float>(plane[static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x)]);
  };
  return std::lerp(std::lerp(value(a.x, a.y), value(b.x, a.y), w.x), std::lerp(value(a.x, b.y), value(b.x, b.y), w.x),
                   w.y);
}

glm::vec3 to_rgb(float y, float cb, float cr) {
  const float b = cb - 128.0f, r = cr - 128.0f;
  return glm::clamp(glm::vec3(y + 1.5748f * r, y - 0.187324f * b - 0.468124f * r, y + 1.8556f * b) / 255.0f, 0.0f,
                    1.0f);
}

// Colour at `at` of the square [corner, corner + side) of a picture; chroma never crosses its edge.
glm::vec3 planes_colour(const DecodedPlanes& p, glm::ivec2 corner, glm::ivec2 side, glm::vec2 at) {
  const float y = bilinear(p.y, p.width, glm::vec2(corner) + at, corner, corner + side);
  const bool half = p.chroma_width < p.width;
  const glm::ivec2 c0 = half ? corner / 2 : corner;
  const glm::ivec2 c1 = half ? (corner + side + 1) / 2 : corner + side;
  const glm::vec2 c_at = (glm::vec2(corner) + at) * (half ? 0.5f : 1.0f);
  return to_rgb(y, bilinear(p.cb, p.chroma_width, c_at, c0, c1), bilinear(p.cr, p.chroma_width, c_at, c0, c1));
}

}  // namespace

DecodedPlanes DecodedPlanes::copy(const encoder::PlanarPicture& picture) {
  DecodedPlanes out;
  out.width = picture.width;
  out.height = picture.height;
  out.chroma_width = picture.chroma_444 ? picture.width : (picture.width + 1) / 2;
  out.chroma_height = picture.chroma_444 ? picture.height : (picture.height + 1) / 2;
  copy_plane(picture.plane[0], picture.stride[0], out.width, out.height, out.y);
  copy_plane(picture.plane[1], picture.stride[1], out.chroma_width, out.chroma_height, out.cb);
  copy_plane(picture.plane[2], picture.stride[2], out.chroma_width, out.chroma_height, out.cr);
  return out;
}

ClientState::ClientState(const atlas::Layout& layout, std::uint32_t phystex_size)
    : slots_per_row_(std::max(phystex_size / kSlotSize, 1u)), tiles_(std::size_t{slots_per_row_} * slots_per_row_) {
  for (const auto& level : layout.levels) pages_.emplace_back(std::size_t{level.tiles_x} * level.tiles_y, kNoSlot);
}

void ClientState::apply(bool key, std::span<const encoder::PageEdit> edits,
                        std::span<const encoder::SlotWrite> writes) {
  if (key)
    for (auto& level : pages_) std::fill(level.begin(), level.end(), kNoSlot);
  for (const auto& edit : edits) {
    const auto level = static_cast<std::size_t>(edit.tile.level());
    if (level < pages_.size() && edit.tile.index() < pages_[level].size()) pages_[level][edit.tile.index()] = edit.slot;
  }
  for (const auto& write : writes)
    if (write.slot < tiles_.size()) tiles_[write.slot] = write.image;
}

void ClientState::set_coarse(DecodedPlanes planes, std::uint32_t width, std::uint32_t height) {
  coarse_ = std::move(planes);
  coarse_size_ = glm::min(glm::vec2(width, height), glm::vec2(coarse_.width, coarse_.height));
}

SlotIndex ClientState::slot_of(TileId tile) const {
  const auto level = static_cast<std::size_t>(tile.level());
  if (level >= pages_.size() || tile.index() >= pages_[level].size()) return kNoSlot;
  const SlotIndex slot = pages_[level][tile.index()];
  return slot < tiles_.size() && tiles_[slot] ? slot : kNoSlot;
}

glm::vec3 ClientState::slot_colour(SlotIndex slot, glm::vec2 at) const {
  if (!picture_.y.empty()) {
    const glm::ivec2 corner = glm::ivec2(slot % slots_per_row_, slot / slots_per_row_) * kSlotSize;
    return planes_colour(picture_, corner, glm::ivec2(kSlotSize), at);
  }
  const TileImage& image = *tiles_[slot];
  const glm::vec2 p = glm::clamp(at - 0.5f, 0.0f, float{kSlotSize - 1});
  const int x = std::min(static_cast<int>(p.x), kSlotSize - 2), y = std::min(static_cast<int>(p.y), kSlotSize - 2);
  const glm::vec2 w = p - glm::vec2(x, y);
  const auto texel = [&](int dx, int dy) {
    const auto* rgb = &image.rgb[static_cast<std::size_t>(((y + dy) * kSlotSize + x + dx) * 3)];
    return glm::vec3(rgb[0], rgb[1], rgb[2]);
  };
  return glm::mix(glm::mix(texel(0, 0), texel(1, 0), w.x), glm::mix(texel(0, 1), texel(1, 1), w.x), w.y) / 255.0f;
}

glm::vec3 ClientState::coarse_colour(glm::vec2 texel) const {
  return planes_colour(coarse_, glm::ivec2(0), glm::ivec2(coarse_size_), texel);
}

}  // namespace darm::accuracy
