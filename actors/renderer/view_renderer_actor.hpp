// The view renderer: shades private tiles, each for the eye of one session, and sends their pictures.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include "actors/renderer/view_messages.hpp"
#include "actors/renderer/view_tile.hpp"
#include "actors/runtime/actor.hpp"
#include "actors/runtime/metrics.hpp"
#include "actors/tile_scheduler/tile_scheduler_messages.hpp"

namespace darm::renderer {

struct ViewRendererOptions {
  ViewTileOptions tile;
  float slice_ms = 6;
  float batch_ms = 40;               ///< of shading between two looks at what sessions want
  std::uint32_t job_samples = 1000;  ///< about so many in one job, but a tile is shaded whole
  std::size_t max_tiles = 16384;     ///< of all sessions, 28 KB each; what is over is not shaded
};

/// Everything but the options is shared with pool work and must be non-null.
struct ViewRendererParts {
  std::shared_ptr<const ViewSurfaces> surfaces;  ///< make_view_surfaces()
  ViewRendererOptions options;
  runtime::Ref<tile_scheduler::Inbox> scheduler;  ///< gets ViewTilesShaded
  runtime::MetricSink* metrics = nullptr;         ///< must outlive the pool's work; null: none
};

/// Works batch by batch: each tile has one writer, and between batches the newest ShadeView of each session takes hold.
/// Sessions share a batch evenly; where there are many, they take turns. Without sessions it does nothing at all.
class ViewRendererActor : public runtime::Actor<ViewInbox> {
 public:
  ViewRendererActor(runtime::Context<ViewInbox> context, ViewRendererParts parts);
  void on(ShadeView&& message);
  void on(LightStored&& message);
  void on(ViewSliceFinished&& message);

 private:
  struct Held {
    std::shared_ptr<ViewTile> tile;
    float share = 0;
    std::uint64_t batch = 0;  // in which it was shaded last
  };
  struct View {
    float target_error = 0;
    std::unordered_map<TileId, Held> tiles;
  };
  struct Job;
  struct Batch;

  void take_wishes();
  void take(const ShadeView& wish);
  void begin_batch();
  void add_jobs(SessionId session, View& view, double budget, Batch& batch);
  void post(const std::shared_ptr<Batch>& batch);
  static void run(const ViewRendererParts& parts, Job& job);
  void finish_batch();
  void publish(SessionId session, std::vector<tile_scheduler::ShadedTile> tiles);
  [[nodiscard]] runtime::MetricSink& metrics() const {
    return parts_->metrics != nullptr ? *parts_->metrics : runtime::null_metrics();
  }

  std::shared_ptr<const ViewRendererParts> parts_;
  std::map<SessionId, View> views_;
  std::map<SessionId, ShadeView> wishes_;
  std::shared_ptr<const StoredLight> stored_;
  std::shared_ptr<Batch> batch_;  // null: idle
  std::uint64_t batch_number_ = 0;
  SessionId last_view_{};  // whose turn it was last
  std::size_t slices_left_ = 0;
  std::size_t tiles_held_ = 0;
  std::uint32_t picture_number_ = 0;
  double sample_us_ = 15;  // running estimate of one sample's time on one worker
};

}  // namespace darm::renderer
