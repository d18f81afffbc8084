#include "actors/renderer/coarse_level.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>

namespace darm::renderer {

namespace {

constexpr std::uint32_t kHurriedPasses = 16;  // of a job: a tile full of texels is some tens of milliseconds

// One job a tile: a tile has one writer.
std::vector<CoarseRequest> by_tile(std::span<const CoarseRequest> texels, const LevelTiles& tiles) {
  std::vector<CoarseRequest> out(texels.begin(), texels.end());
  std::erase_if(out, [&](const CoarseRequest& r) { return r.tile >= tiles.x * tiles.y; });
  std::ranges::stable_sort(out, {}, &CoarseRequest::tile);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (kept > 0 && out[kept - 1].tile == out[i].tile)
      out[kept - 1].mask |= out[i].mask;
    else
      out[kept++] = out[i];
  }
  out.resize(kept);
  return out;
}

}  // namespace

void CoarseRounds::prefer(std::span<const CoarseRequest> seen) {
  if (!opening()) return;
  preferred_ = by_tile(seen, tiles_);
  preferred_cursor_ = 0;  // what was done is done: shading it again takes no samples
}

void CoarseRounds::hurry(std::span<const CoarseRequest> texels, std::uint32_t samples) {
  hurried_ = by_tile(texels, tiles_);
  hurried_cursor_ = 0;
  hurried_samples_ = samples;
  hurried_step_ = 1;
  hurried_due_ = hurries();
}

TileJob CoarseRounds::job_for(std::uint32_t tile, const TexelMask& mask) const {
  TileJob job;
  job.tile = TileId(level_, tile);
  job.mask = mask;
  job.passes = 1;
  job.most = std::max(round_, 1u);
  job.cost = static_cast<std::uint32_t>(mask.count());
  job.coarse = true;
  return job;
}

void CoarseRounds::next_hurried() {
  if (++hurried_cursor_ < hurried_.size() || hurried_step_ >= hurried_samples_) return;
  hurried_cursor_ = 0;
  hurried_step_ =
      std::min(hurried_step_ < kHurriedPasses ? kHurriedPasses : hurried_step_ + kHurriedPasses, hurried_samples_);
}

std::vector<TileJob> CoarseRounds::next_batch(std::uint64_t samples) {
  std::vector<TileJob> jobs;
  std::uint64_t taken = 0;
  if (hurries()) {
    const std::uint32_t step = hurried_step_;  // a tile comes once in a batch
    while (hurries() && hurried_step_ == step && taken < samples) {
      jobs.push_back(job_for(hurried_[hurried_cursor_].tile, hurried_[hurried_cursor_].mask));
      TileJob& job = jobs.back();
      job.passes = std::min(step, kHurriedPasses);
      job.most = step;
      job.cost *= job.passes;
      job.hurried = true;
      taken += job.cost;
      next_hurried();
    }
    return jobs;
  }
  if (preferring()) {
    for (; preferred_cursor_ < preferred_.size() && taken < samples; ++preferred_cursor_) {
      const auto& wanted = preferred_[preferred_cursor_];
      jobs.push_back(job_for(wanted.tile, wanted.mask));
      taken += jobs.back().cost;
    }
    return jobs;
  }
  if (finished()) return jobs;
  for (; cursor_ < tiles_.x * tiles_.y && taken < samples; ++cursor_) {
    jobs.push_back(job_for(cursor_, TexelMask::all()));
    taken += jobs.back().cost;
  }
  return jobs;
}

CoarseDue CoarseRounds::batch_finished() {
  if (hurries()) return CoarseDue::kNothing;
  if (std::exchange(hurried_due_, false)) return CoarseDue::kLight;
  if (finished() || preferring()) return CoarseDue::kNothing;
  if (opening() && !preferred_.empty()) {
    opened_ = true;
    return CoarseDue::kPicture;
  }
  if (cursor_ < tiles_.x * tiles_.y) return CoarseDue::kNothing;
  const std::uint32_t done = round_++;
  cursor_ = 0;
  return done == 0 || std::has_single_bit(done) || done == rounds_ ? CoarseDue::kPicture : CoarseDue::kNothing;
}

CoarseCanvas::CoarseCanvas(LevelTiles tiles, std::uint32_t version)
    : tiles_(tiles), picture_(std::make_shared<CoarsePicture>()), drawn_(std::size_t{tiles.x} * tiles.y, 0) {
  picture_->version = version;
  picture_->width = tiles.x * kTileSize;
  picture_->height = tiles.y * kTileSize;
  picture_->rgb.resize(std::size_t{picture_->width} * picture_->height * 3);
  picture_->errors.assign(drawn_.size(), kUnknownError);
}

void CoarseCanvas::put(std::uint32_t tile_index, const TileImage& image, float error) {
  copy(tile_index, image);
  picture_->errors[tile_index] = error;
  drawn_[tile_index] = 1;
}

void CoarseCanvas::copy(std::uint32_t tile_index, const TileImage& image) {
  const std::size_t x = tile_index % tiles_.x * kTileSize;
  const std::size_t y = tile_index / tiles_.x * kTileSize;
  for (std::size_t row = 0; row < kTileSize; ++row)
    std::memcpy(&picture_->rgb[((y + row) * picture_->width + x) * 3], &image.rgb[((row + 1) * kSlotSize + 1) * 3],
                kTileSize * 3);
}

std::shared_ptr<const CoarsePicture> CoarseCanvas::finish(float least_error) {
  for (float& error : picture_->errors) error = std::max(error, least_error);
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
    // Grey: the colour would be another thing's.
    colour[t].fill(static_cast<std::uint8_t>((2126 * sum[0] + 7152 * sum[1] + 722 * sum[2]) / (10'000 * kTileTexels)));
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
      copy(to->index(), flat);
      drawn_[to->index()] = 1;
      queue.push_back(to->index());
    }
  }
  return picture_;
}

}  // namespace darm::renderer
