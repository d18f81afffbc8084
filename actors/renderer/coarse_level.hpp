// The coarsest level as a whole: what a new client sees first, shaded in rounds beside the working set.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "actors/renderer/tile_display.hpp"
#include "actors/renderer/tile_schedule.hpp"

namespace darm::renderer {

/// Display error of what is not known to be as bright as it is: a quarter of the range, as of what is filled.
inline constexpr float kUnknownError = 0.25f;

/// The coarse level as a picture, sRGB, interleaved, top row first. No texel is left black for want of light.
struct CoarsePicture {
  std::uint32_t version = 0;  ///< 1, 2, 3, ...
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> rgb;
  /// Of each of its tiles, row-major: RMS display error expected of its light, 0..1.
  std::vector<float> errors;
};

enum class CoarseDue : std::uint8_t {
  kNothing,
  kLight,    ///< for paths to end in
  kPicture,  ///< and that
};

/// Round 0 is every tile's first pass (see shade_tile), round r then brings every texel to r samples. A picture is due
/// after the tiles that a view asked for, and after rounds 0, 1, 2, 4, 8, ... and the last. Texels that much of the
/// scene's light comes from may be brought on ahead of the rounds; light is due after these.
class CoarseRounds {
 public:
  /// `rounds` 0: the coarse level is left alone.
  CoarseRounds(int level, LevelTiles tiles, std::uint32_t rounds) : level_(level), tiles_(tiles), rounds_(rounds) {}

  [[nodiscard]] bool finished() const { return round_ > rounds_ || rounds_ == 0; }
  /// Before the first picture: until a client has it, nothing else can be shown.
  [[nodiscard]] bool opening() const { return round_ == 0 && !opened_ && !finished(); }
  /// What somebody sees now: while the first picture is not there, it comes first and is enough for one.
  void prefer(std::span<const CoarseRequest> seen);
  /// These are brought to `samples` before anything else.
  void hurry(std::span<const CoarseRequest> texels, std::uint32_t samples);
  [[nodiscard]] bool hurries() const { return hurried_cursor_ < hurried_.size(); }
  /// Those, one request a tile, until the next call of hurry().
  [[nodiscard]] std::span<const CoarseRequest> hurried() const { return hurried_; }
  /// Every texel has two samples.
  [[nodiscard]] bool even() const { return round_ > 2; }
  /// That which is under way.
  [[nodiscard]] std::uint32_t round() const { return round_; }
  [[nodiscard]] int level() const { return level_; }
  [[nodiscard]] const LevelTiles& tiles() const { return tiles_; }

  /// Jobs worth about `samples` from the current round, which ends with the last of its tiles.
  [[nodiscard]] std::vector<TileJob> next_batch(std::uint64_t samples);
  /// There is a picture already, and every texel has `samples`: the rounds up to that are over. Call before the first
  /// batch.
  void resume(std::uint32_t samples) {
    opened_ = true;
    if (samples > 0) round_ = std::min(samples, rounds_) + 1;
  }
  /// Call when all jobs handed out are done: what is due now.
  CoarseDue batch_finished();

 private:
  [[nodiscard]] TileJob job_for(std::uint32_t tile, const TexelMask& mask) const;
  void next_hurried();
  [[nodiscard]] bool preferring() const { return opening() && preferred_cursor_ < preferred_.size(); }

  int level_;
  LevelTiles tiles_;
  std::uint32_t rounds_;
  std::uint32_t round_ = 0;
  std::uint32_t cursor_ = 0;
  std::vector<CoarseRequest> preferred_;
  std::size_t preferred_cursor_ = 0;
  std::vector<CoarseRequest> hurried_;
  std::size_t hurried_cursor_ = 0;
  std::uint32_t hurried_samples_ = 0;
  std::uint32_t hurried_step_ = 0;  // how many they have after this time around; the first is a first pass
  bool hurried_due_ = false;
  bool opened_ = false;  // the preferred texels are done
};

/// A coarse picture being put together; different tiles may be drawn from different threads.
class CoarseCanvas {
 public:
  CoarseCanvas(LevelTiles tiles, std::uint32_t version);
  /// `error`: as TilePicture has it.
  void put(std::uint32_t tile_index, const TileImage& image, float error);
  /// Gives tiles that were not put the mean brightness of the nearest one that was, as a grey. No tile's error is under
  /// `least_error`.
  [[nodiscard]] std::shared_ptr<const CoarsePicture> finish(float least_error = 0);

 private:
  void copy(std::uint32_t tile_index, const TileImage& image);

  LevelTiles tiles_;
  std::shared_ptr<CoarsePicture> picture_;
  std::vector<std::uint8_t> drawn_;
};

}  // namespace darm::renderer
