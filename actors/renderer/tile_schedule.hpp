// Which tiles are shaded next, how far, and when their picture is worth sending. Pure bookkeeping.
#pragma once

#include <cstdint>
#include <functional>
#include <unordered_map>
#include <vector>

#include "actors/renderer/renderer_messages.hpp"
#include "actors/renderer/texel_shading.hpp"
#include "actors/renderer/tile_surface.hpp"

namespace darm::renderer {

/// Shade (or, with no passes, look at) one tile.
struct TileJob {
  TileId tile;
  TexelMask mask;
  std::uint32_t passes = 0;          ///< 0: survey, no sample is taken
  std::uint32_t most = 0xffffffffu;  ///< no texel beyond this many samples
  std::uint32_t cost = 0;            ///< estimated samples
  bool hurried = false;              ///< ahead of its round
  bool renew = false;                ///< few samples of soft light are replaced
  bool coarse = false;               ///< for the coarse level, not for the working set
  bool recall = false;               ///< take the stored picture, draw nothing
  bool keep = true;                  ///< store the picture
};

struct ScheduleOptions {
  std::uint32_t max_samples = 4096;  ///< a texel
  float publish_growth = 2.0f;       ///< a picture again after this factor in samples; > 1
  std::uint32_t job_samples = 1000;  ///< about so many in one job
};

class TileSchedule {
 public:
  TileSchedule(std::vector<LevelTiles> levels, const ScheduleOptions& options);

  /// A new working set in place of the old one. `stored`: may the store hold light of this tile?
  void replace(const std::vector<TileRequest>& work, const std::function<bool(TileId)>& stored);

  /// Jobs worth about `samples`, each tile at most once: first tiles whose light is stored but not shown, then by
  /// weight * expected fall of squared error per sample: a tile that shows much gets its second pass before one that
  /// shows little its first. Empty: nothing to do.
  [[nodiscard]] std::vector<TileJob> next_batch(std::uint64_t samples);
  [[nodiscard]] bool has(TileId tile) const { return tiles_.contains(tile); }

  /// What a job did. Tiles no longer wanted are ignored.
  void shaded(TileId tile, const TileProgress& progress, std::uint32_t samples);
  /// The job failed: true if the tile may try once more, false if it is quarantined now.
  bool failed(TileId tile);

  /// Tiles whose picture is due: their first, texels that no picture was drawn for, samples grown by publish_growth,
  /// the end of their work; those that borrow light from a neighbour whose samples have grown by publish_growth; and,
  /// when no first pass waits, those whose neighbour got its first light.
  [[nodiscard]] std::vector<TileId> pictures_due() const;
  /// `lost_share`: as TilePicture has it.
  void pictured(TileId tile, float error, float lost_share = 0);

  /// Tiles that were never pictured here, but whose light, and so perhaps whose picture, is stored. Each comes once.
  [[nodiscard]] std::vector<TileId> recalls_due();
  /// A stored picture of the tile, made from a mean of `samples` a texel, was sent.
  void recalled(TileId tile, float error, float samples);
  /// The picture did not reach anybody: it is due again.
  void forget_picture(TileId tile);
  [[nodiscard]] const TexelMask* mask_of(TileId tile) const;

 private:
  struct State {
    TexelMask mask;
    TexelMask shown;  // what the pictures sent so far were drawn for
    float weight = 0;
    bool display = true;
    float target_error = 0;
    bool surveyed = false;
    bool asked_store = false;  // for its picture
    bool stored = false;
    bool fresh_texels = false;  // some have light that no picture has shown
    bool recalled = false;      // the last picture came from the store: what it was drawn for is not known
    bool stale_border = false;
    bool borrows = false;  // much of the last picture's light is shared with its neighbours
    bool quarantined = false;
    int failures = 0;
    TileProgress progress;
    float pictured_mean = -1;  // samples at the last picture; -1: none
    float told_mean = 0;       // samples when its neighbours were last told of them
    float error = -1;          // of the last picture
  };
  enum class Need { kNothing, kSurvey, kFirst, kMore };
  [[nodiscard]] std::vector<TileId> beside_of(TileId tile) const;
  [[nodiscard]] Need need_of(TileId tile, const State& s) const;
  [[nodiscard]] bool on_target(const State& s) const;
  [[nodiscard]] bool finished(TileId tile, const State& s) const;
  [[nodiscard]] double gain_of(TileId tile, const State& s, Need need) const;
  [[nodiscard]] TileJob job_for(TileId tile, const State& s, Need need) const;

  std::vector<LevelTiles> levels_;
  ScheduleOptions options_;
  std::unordered_map<TileId, State> tiles_;
};

}  // namespace darm::renderer
