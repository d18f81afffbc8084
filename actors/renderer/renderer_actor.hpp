// The renderer: shades what somebody sees, batch by batch on the pool, and sends pictures of tiles as they get better.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <unordered_set>
#include <vector>

#include "actors/renderer/coarse_level.hpp"
#include "actors/renderer/renderer_messages.hpp"
#include "actors/renderer/tile_display.hpp"
#include "actors/renderer/tile_facts.hpp"
#include "actors/renderer/tile_schedule.hpp"
#include "actors/runtime/actor.hpp"
#include "actors/runtime/metrics.hpp"
#include "actors/tile_scheduler/tile_scheduler_messages.hpp"

namespace darm::renderer {

struct RendererOptions {
  DisplayOptions display;
  ScheduleOptions schedule;
  float slice_ms = 6;   ///< work of one pool slice
  float batch_ms = 40;  ///< of shading between two rounds of pictures: how soon a new working set takes hold
  std::uint32_t coarse_rounds = 64;  ///< samples a texel of the coarse level; 0: it is left alone
  float coarse_share = 0.1f;         ///< of shading while clients are served, once the coarse level has a first picture
};

/// What the renderer works with; everything but the options is shared with pool work and must be non-null.
struct RendererParts {
  std::shared_ptr<TileSurfaces> surfaces;       ///< make_scene_surfaces(); the renderer alone calls use_stored_light()
  std::shared_ptr<atlas::RadianceStore> store;  ///< the renderer is its only writer, and reader while it runs
  std::vector<LevelTiles> levels;               ///< level_tiles_of()
  std::shared_ptr<const atlas::Layout> layout;  ///< null: light is not stored for paths to end in
  RendererOptions options;
  runtime::Ref<tile_scheduler::Inbox> scheduler;  ///< gets TilesShaded
  /// Gets each new picture of the coarse level, on the renderer's turn. May be empty.
  std::function<void(std::shared_ptr<const CoarsePicture>)> coarse;
  /// Gets each new snapshot of stored light, on the renderer's turn. May be empty.
  std::function<void(std::shared_ptr<const StoredLight>)> light;
  runtime::MetricSink* metrics = nullptr;  ///< must outlive the pool's work; null: none
};

/// Works in phases that never overlap: a batch of shading (each tile has one writer), then pictures (readers only),
/// then, where the coarse level was drawn, a look for what paths may aim at. Between batches the newest ShadeTiles
/// takes hold. Its mailbox must hold a batch's slices: capacity 1024 serves 64 workers.
class RendererActor : public runtime::Actor<Inbox> {
 public:
  RendererActor(runtime::Context<Inbox> context, RendererParts parts);
  void on_start() override;
  void on(ShadeTiles&& message);
  void on(SliceFinished&& message);

 private:
  enum class Phase { kIdle, kShading, kPictures, kStoredLight };
  struct Shared;  // what pool work touches
  struct JobResult;
  struct Batch;  // one phase's work and results

  void begin_batch();
  [[nodiscard]] bool begin_recall();
  void resume_coarse();
  void finish_shading();
  void begin_pictures();
  void add_coarse_level(Batch& batch, CoarseDue due, bool recall);
  void draw(const std::shared_ptr<Batch>& batch);
  void finish_pictures();
  void send_pictures();
  void begin_stored_light();
  void finish_stored_light();
  void post_slices(const std::shared_ptr<Batch>& batch, std::vector<std::size_t> starts,
                   void (*work)(Shared&, Batch&, std::size_t));
  [[nodiscard]] std::vector<TileJob> choose_jobs();
  [[nodiscard]] bool rare_light() const;
  void renew(std::vector<TileJob>& jobs);
  void learn_aim(bool aims);
  [[nodiscard]] double coarse_share() const;
  [[nodiscard]] static float mean_lost_share(const Batch& batch);
  static void shade_one(Shared& shared, Batch& batch, std::size_t index);
  static void find_bright(Shared& shared, Batch& batch, std::size_t index);
  static void picture_one(Shared& shared, Batch& batch, std::size_t index);
  void learn_cost(double seconds, std::uint64_t samples);

  std::shared_ptr<Shared> shared_;
  TileSchedule schedule_;
  CoarseRounds coarse_;
  std::optional<ShadeTiles> waiting_;
  Phase phase_ = Phase::kIdle;
  std::shared_ptr<Batch> batch_;
  std::uint64_t batch_number_ = 0;
  std::size_t slices_left_ = 0;
  std::int64_t phase_began_us_ = 0;
  double sample_us_ = 12;  // running estimate of one sample's time on one worker
  std::uint32_t picture_number_ = 0;
  std::uint32_t coarse_number_ = 0;
  double coarse_credit_ = 0;  // samples the coarse level may take
  bool aims_ = false;         // paths aim at bright texels
  bool renews_ = false;
  std::unordered_set<TileId> renewed_;            // where samples from before that are replaced
  std::optional<std::uint32_t> unsettled_until_;  // this round of the coarse level is over: it was lit before that
  float coarse_lost_share_ = 0;                   // mean of its tiles, as TilePicture has it
  CoarseDue coarse_due_ = CoarseDue::kNothing;
};

}  // namespace darm::renderer
