#include "actors/renderer/view_renderer_actor.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <utility>

namespace darm::renderer {
namespace {

constexpr std::size_t kViewsPerBatch = 8;  // choosing among the tiles of a view takes as long as shading some

}  // namespace

struct ViewRendererActor::Job {
  SessionId session{};
  TileId tile;
  std::shared_ptr<ViewTile> state;
  std::shared_ptr<const StoredLight> stored;
  std::uint32_t passes = 1;
  std::uint32_t cost = 0;
  // results
  std::uint32_t samples = 0;
  double seconds = 0;
  std::optional<TilePicture> picture;
  bool failed = false;
};

struct ViewRendererActor::Batch {
  std::vector<Job> jobs;
};

ViewRendererActor::ViewRendererActor(runtime::Context<ViewInbox> context, ViewRendererParts parts)
    : Actor(std::move(context)), parts_(std::make_shared<ViewRendererParts>(std::move(parts))) {}

void ViewRendererActor::on(ShadeView&& message) {
  const auto id = message.session;
  wishes_.insert_or_assign(id, std::move(message));
  if (!batch_) begin_batch();
}

void ViewRendererActor::on(ViewSliceFinished&& message) {
  if (!batch_ || message.batch != batch_number_ || slices_left_ == 0) return;
  if (--slices_left_ == 0) finish_batch();
}

void ViewRendererActor::take_wishes() {
  for (const auto& [id, wish] : wishes_) take(wish);
  wishes_.clear();
  metrics().set("darm_view_tiles_held", static_cast<double>(tiles_held_));
  metrics().set("darm_view_sessions", static_cast<double>(views_.size()));
}

void ViewRendererActor::take(const ShadeView& wish) {
  auto found = views_.find(wish.session);
  const std::size_t before = found == views_.end() ? 0 : found->second.tiles.size();
  tiles_held_ -= before;
  if (!wish.work || wish.work->empty()) {
    if (found != views_.end()) views_.erase(found);
    return;
  }
  std::unordered_map<TileId, Held> kept;
  auto& view = views_[wish.session];
  view.target_error = wish.target_error;
  auto& tiles = view.tiles;
  for (const auto& request : *wish.work) {
    if (tiles_held_ >= parts_->options.max_tiles) {
      metrics().count("darm_view_tiles_refused_total");
      continue;
    }
    Held held;
    if (const auto old = tiles.find(request.tile); old != tiles.end()) held = old->second;
    if (!held.tile) held.tile = std::make_shared<ViewTile>(parts_->options.tile.exposure);
    held.share = request.share;
    held.tile->want(request.mask);
    held.tile->see_from(wish.eye, parts_->options.tile);
    tiles_held_ += kept.emplace(request.tile, std::move(held)).second ? 1 : 0;
  }
  tiles = std::move(kept);
}

void ViewRendererActor::on(LightStored&& message) { stored_ = std::move(message.light); }

// The first pass over what is new first, by share and by how long it has waited (an eye that never rests would else
// starve the last); then where share times the fall of squared error per sample is most.
void ViewRendererActor::add_jobs(SessionId session, View& view, double budget, Batch& batch) {
  struct Candidate {
    double gain;
    TileId tile;
    Held* held;
  };
  std::vector<Candidate> candidates;
  for (auto& [tile, held] : view.tiles) {
    if (held.tile->finished(parts_->options.tile, view.target_error)) continue;
    const double n = double{held.tile->least()};
    const double gain = n < 1 ? 1e9 * (1e-4 + double{held.share}) * static_cast<double>(batch_number_ + 1 - held.batch)
                              : double{held.share * held.tile->display_variance()} / (n * (n + 1));
    candidates.push_back({gain / std::max(1, held.tile->wanted()), tile, &held});
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const auto& a, const auto& b) { return std::pair(-a.gain, a.tile) < std::pair(-b.gain, b.tile); });
  for (const auto& c : candidates) {
    if (budget <= 0) return;
    const auto wanted = static_cast<std::uint32_t>(std::max(1, c.held->tile->wanted()));
    const float doubling = std::clamp(std::ceil(c.held->tile->least()), 1.0f, 64.0f);
    c.held->batch = batch_number_ + 1;
    Job job;
    job.session = session;
    job.tile = c.tile;
    job.state = c.held->tile;
    job.stored = stored_;
    job.passes = std::clamp(parts_->options.job_samples / wanted, 1u, static_cast<std::uint32_t>(doubling));
    job.cost = job.passes * wanted;
    budget -= job.cost;
    batch.jobs.push_back(std::move(job));
  }
}

void ViewRendererActor::begin_batch() {
  batch_ = nullptr;
  take_wishes();
  if (views_.empty()) return;
  auto batch = std::make_shared<Batch>();
  const auto most = std::min(views_.size(), kViewsPerBatch);
  const double budget =
      double{parts_->options.batch_ms} * 1000.0 * executor().workers() / sample_us_ / static_cast<double>(most);
  std::size_t served = 0;
  auto next = views_.upper_bound(last_view_);
  for (std::size_t looked_at = 0; looked_at < views_.size() && served < most; ++looked_at, ++next) {
    if (next == views_.end()) next = views_.begin();
    last_view_ = next->first;
    const auto before = batch->jobs.size();
    add_jobs(next->first, next->second, budget, *batch);
    served += batch->jobs.size() > before ? 1 : 0;
  }
  if (!batch->jobs.empty()) post(batch);
}

void ViewRendererActor::post(const std::shared_ptr<Batch>& batch) {
  batch_ = batch;
  ++batch_number_;
  const double slice = double{parts_->options.slice_ms} * 1000.0 / sample_us_;
  std::vector<std::size_t> starts;
  double filled = slice;
  for (std::size_t i = 0; i < batch->jobs.size(); ++i) {
    if (filled >= slice) {
      starts.push_back(i);
      filled = 0;
    }
    filled += batch->jobs[i].cost;
  }
  slices_left_ = starts.size();
  for (std::size_t s = 0; s < starts.size(); ++s) {
    const std::size_t end = s + 1 < starts.size() ? starts[s + 1] : batch->jobs.size();
    executor().post(runtime::Priority::kNormal,
                    [parts = parts_, batch, first = starts[s], end, me = self(), number = batch_number_] {
                      for (std::size_t i = first; i < end; ++i) run(*parts, batch->jobs[i]);
                      me.tell(ViewSliceFinished(number));
                    });
  }
}

void ViewRendererActor::run(const ViewRendererParts& parts, Job& job) {
  const auto began = std::chrono::steady_clock::now();
  try {
    const auto surface = parts.surfaces->tile(job.tile, job.stored);
    if (!surface) return;
    job.samples = job.state->shade(*surface, job.passes);
    if (job.state->picture_due(parts.options.tile)) job.picture = job.state->draw(*surface);
  } catch (const std::exception&) {
    job.failed = true;
  }
  job.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
}

void ViewRendererActor::finish_batch() {
  const auto batch = std::exchange(batch_, nullptr);
  std::map<SessionId, std::vector<tile_scheduler::ShadedTile>> pictures;
  double seconds = 0;
  std::uint64_t samples = 0;
  for (auto& job : batch->jobs) {
    seconds += job.seconds;
    samples += job.samples;
    const auto view = views_.find(job.session);
    if (job.failed) {
      metrics().count("darm_view_failed_tiles_total");
      if (view != views_.end()) tiles_held_ -= view->second.tiles.erase(job.tile);
      continue;
    }
    if (!job.picture) continue;
    tile_scheduler::ShadedTile shaded;
    shaded.tile = job.tile;
    shaded.version = ++picture_number_;
    shaded.error = job.picture->error;
    shaded.samples = job.picture->samples;
    shaded.image = std::move(job.picture->image);
    pictures[job.session].push_back(std::move(shaded));
  }
  if (samples >= 64)
    sample_us_ += 0.25 * (std::clamp(seconds * 1e6 / static_cast<double>(samples), 0.2, 5000.0) - sample_us_);
  metrics().count("darm_view_samples_total", static_cast<double>(samples));
  metrics().count("darm_view_shade_seconds_total", seconds);
  for (auto& [session, tiles] : pictures) publish(session, std::move(tiles));
  begin_batch();
}

void ViewRendererActor::publish(SessionId session, std::vector<tile_scheduler::ShadedTile> tiles) {
  metrics().count("darm_view_pictures_total", static_cast<double>(tiles.size()));
  std::vector<TileId> names;
  for (const auto& t : tiles) names.push_back(t.tile);
  if (parts_->scheduler.tell(tile_scheduler::ViewTilesShaded(session, std::move(tiles))) || !parts_->scheduler) return;
  const auto view = views_.find(session);
  if (view == views_.end()) return;
  for (const auto tile : names)
    if (const auto held = view->second.tiles.find(tile); held != view->second.tiles.end())
      held->second.tile->forget_picture();
}

}  // namespace darm::renderer
