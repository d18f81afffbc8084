#include "actors/renderer/coarse_level.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace darm::renderer {

namespace {

TexelMask every_fourth() {
  TexelMask mask;
  for (int y = 0; y < kTileSize; y += 2)
    for (int x = 0; x < kTileSize; x += 2) mask.set(x, y);
  return mask;
}

}  // namespace

std::vector<TileJob> CoarseRounds::next_batch(std::uint64_t samples) {
  std::vector<TileJob> jobs;
  if (finished()) return jobs;
  std::uint64_t taken = 0;
  const TexelMask mask = round_ == 0 ? every_fourth() : TexelMask::all();
  for (; cursor_ < tiles_.x * tiles_.y && taken < samples; ++cursor_) {
    TileJob job;
    job.tile = TileId(level_, cursor_);
    job.mask = mask;
    job.passes = 1;
    job.most = std::max(round_, 1u);
    job.cost = static_cast<std::uint32_t>(mask.count());
    job.coarse = true;
    taken += job.cost;
    jobs.push_back(job);
  }
  return jobs;
}

bool CoarseRounds::batch_finished() {
  if (finished() || cursor_ < tiles_.x * tiles_.y) return false;
  const std::uint32_t done = round_++;
  cursor_ = 0;
  return done == 0 || std::has_single_bit(done) || done == rounds_;
}

CoarseCanvas::CoarseCanvas(LevelTiles tiles, std::uint32_t version)
    : tiles_(tiles), picture_(std::make_shared<CoarsePicture>()), drawn_(std::size_t{tiles.x} * tiles.y, 0) {
  picture_->version = version;
  picture_->width = tiles.x * kTileSize;
  picture_->height = tiles.y * kTileSize;
  picture_->rgb.resize(std::size_t{picture_->width} * picture_->height * 3);
}

void CoarseCanvas::put(std::uint32_t tile_index, const TileImage& image) {
  const std::size_t x = tile_index % tiles_.x * kTileSize;
  const std::size_t y = tile_index / tiles_.x * kTileSize;
  for (std::size_t row = 0; row < kTileSize; ++row)
    std::memcpy(&picture_->rgb[((y + row) * picture_->width + x) * 3], &image.rgb[((row + 1) * kSlotSize + 1) * 3],
                kTileSize * 3);
  drawn_[tile_index] = 1;
}

std::shared_ptr<const CoarsePicture> CoarseCanvas::finish() {
  std::vector<std::array<std::uint8_t, 3>> colour(drawn_.size());
  std::vector<std::uint32_t> queue;
  for (std::uint32_t t = 0; t < drawn_.size(); ++t) {
    if (!drawn_[t]) continue;
    std::array<std::uint64_t, 3> sum{};
    for (std::size_t i = 0; i < kTileTexels; ++i) {
      const std::size_t at =
          (t / tiles_.x * kTileSize + i / kTileSize) * picture_->width + t % tiles_.x * kTileSize + i % kTileSize;
      for (std::size_t c = 0; c < 3; ++c) sum[c] += picture_->rgb[at * 3 + c];
    }
    for (std::size_t c = 0; c < 3; ++c) colour[t][c] = static_cast<std::uint8_t>(sum[c] / kTileTexels);
    queue.push_back(t);
  }
  TileImage flat;
  for (std::size_t head = 0; head < queue.size(); ++head) {
    const TileId from(0, queue[head]);
    for (const auto& [dx, dy] : {std::pair{1, 0}, std::pair{-1, 0}, std::pair{0, 1}, std::pair{0, -1}}) {
      const auto to = neighbour_of(from, tiles_, dx, dy);
      if (!to || drawn_[to->index()]) continue;
      colour[to->index()] = colour[from.index()];
      for (std::size_t i = 0; i < flat.rgb.size(); ++i) flat.rgb[i] = colour[to->index()][i % 3];
      put(to->index(), flat);
      queue.push_back(to->index());
    }
  }
  return picture_;
}

}  // namespace darm::renderer
