#include "actors/tile_scheduler/tile_scheduler_actor.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace darm::tile_scheduler {
namespace {

constexpr Microseconds kWorkPause = 4;  // times as long as it took

Microseconds period_of(double updates_per_second) {
  const double rate = std::isfinite(updates_per_second) ? std::clamp(updates_per_second, 0.1, 1000.0) : 10.0;
  return static_cast<Microseconds>(1e6 / rate);
}

bool same_view(const ViewChanged& a, const ViewChanged& b) {
  return a.camera.position == b.camera.position && a.camera.orientation == b.camera.orientation &&
         a.camera.fovy == b.camera.fovy && a.viewport.width == b.viewport.width &&
         a.viewport.height == b.viewport.height;
}

// One step of a slice. The next one waits behind those of other views, so that a small view need not wait for a large
// one.
void post_step(runtime::Executor& executor, std::shared_ptr<ViewJob> job, unsigned slice,
               runtime::Ref<tile_scheduler::Inbox> scheduler) {
  executor.post(runtime::Priority::kHigh, [&executor, job = std::move(job), slice, scheduler = std::move(scheduler)] {
    const auto before = executor.thread_time();
    const auto step = job->run_step(slice);
    job->note_busy((executor.thread_time() - before).count());
    if (step == ViewJob::Step::kMore) post_step(executor, job, slice, scheduler);
    if (step == ViewJob::Step::kAllDone) scheduler.tell(ViewTraced(job->number()));
  });
}

ViewAnswer answer_to(const ViewChanged& view) {
  ViewAnswer answer;
  answer.session = view.session;
  answer.sequence = view.sequence;
  answer.stamps = view.stamps;
  return answer;
}

}  // namespace

TileSchedulerActor::TileSchedulerActor(runtime::Context<tile_scheduler::Inbox> context,
                                       std::shared_ptr<const atlas::Layout> layout,
                                       std::shared_ptr<const renderer::trace::RayScene> rays,
                                       std::shared_ptr<const Peers> peers, SchedulerOptions options,
                                       runtime::MetricSink& metrics,
                                       std::shared_ptr<const std::vector<scene::ViewMaterial>> view_materials)
    : Actor(std::move(context)),
      layout_(std::move(layout)),
      rays_(std::move(rays)),
      peers_(std::move(peers)),
      options_(options),
      metrics_(metrics),
      period_(period_of(options.updates_per_second)),
      looking_(options.looking * executor().workers()),
      pace_(options.coding * executor().workers()),
      images_(options.image_bytes),
      groups_(options.groups, [this] { return StreamId{next_stream_++}; }) {
  const bool fits = view_materials && view_materials->size() == layout_->instances.size();
  if (fits && peers_->view_renderer && scene::calls_for_view_layer(*view_materials)) view_materials_ = view_materials;
  options_.passes_moving = std::clamp(options_.passes_moving, 1, kAllPasses);
  options_.passes_still = std::clamp(options_.passes_still, 1, kAllPasses);
}

void TileSchedulerActor::on_start() { schedule_tick(); }

void TileSchedulerActor::schedule_tick() {
  executor().after(std::chrono::microseconds(period_), [ref = self()] { ref.tell(Tick()); });
}

TileSchedulerActor::Session* TileSchedulerActor::find(SessionId id) {
  const auto it = sessions_.find(id);
  return it == sessions_.end() ? nullptr : it->second.get();
}

ImageLookup TileSchedulerActor::images() const {
  return [this](TileId tile) { return images_.find(tile); };
}

void TileSchedulerActor::on(SessionOpened&& message) {
  if (find(message.session) != nullptr) return;
  auto session = std::make_unique<Session>(message.format, options_);
  session->id = message.session;
  session->target_error = message.target_error;
  if (view_materials_ && message.format.view_phystex > 0) open_view(*session);
  sessions_.emplace(message.session, std::move(session));
}

void TileSchedulerActor::on(SessionClosed&& message) {
  const auto it = sessions_.find(message.session);
  if (it == sessions_.end()) return;
  close_view(*it->second);
  groups_.remove(message.session);
  const auto stream = it->second->stream ? it->second->stream->id : StreamId{};
  leave(*it->second);
  sessions_.erase(it);
  if (const auto left = streams_.find(stream); left != streams_.end()) settle(*left->second);
  send_work();  // what only this session saw is no longer shaded
}

void TileSchedulerActor::on(ViewChanged&& message) {
  auto* session = find(message.session);
  if (session == nullptr || !is_valid(message.camera) || !is_valid(message.viewport)) return;
  if (session->view && message.sequence <= session->view->sequence) return;
  session->view = std::move(message);
  // A camera that rests since the last update is looked at right away, not only at the next tick.
  if (now_us() - session->last_start >= period_) start_view(*session);
}

void TileSchedulerActor::on(KeyFrameWanted&& message) {
  auto* session = find(message.session);
  if (session == nullptr) return;
  if (message.layer == StreamLayer::kView) {
    force_view_key(*session);
    if (session->view_key_put_off) metrics_.count("darm_view_key_frames_put_off_total");
    return;
  }
  if (session->stream == nullptr) return;  // it begins with one
  force_key(*session->stream);
  if (session->stream->key_put_off)
    metrics_.count("darm_key_frames_put_off_total", 1);
  else
    compose(*session->stream);
}

void TileSchedulerActor::on(TilesShaded&& message) {
  for (const auto& tile : message.tiles) pictures_came_ = images_.put(tile) || pictures_came_;
}

void TileSchedulerActor::on(ViewTilesShaded&& message) {
  auto* session = find(message.session);
  if (session == nullptr || !session->view_layer) return;
  session->view_layer->put(message.tiles);
  compose_view(*session);
}

void TileSchedulerActor::on(CoarsePictured&& message) {
  const bool first = coarse_ == nullptr;
  coarse_ = std::move(message.picture);
  if (!first) return;
  for (auto& [id, session] : sessions_)
    if (session->view_layer) send_view_work(*session);
}

void TileSchedulerActor::on(FrameDone&& message) {
  if (const auto it = streams_.find(message.stream); it != streams_.end()) {
    auto& stream = *it->second;
    pace_.done(message.busy);
    stream.state.frame_done(message.frame, message.ok, message.settled);
    const auto waits = [](const Session* member) { return member->answer.has_value(); };
    if (stream.state.has_answers() || std::ranges::any_of(stream.members, waits)) compose(stream);
    return;
  }
  for (auto& [id, session] : sessions_)
    if (session->view_layer && session->view_stream_id == message.stream)
      session->view_layer->stream().frame_done(message.frame, message.ok, message.settled);
}

void TileSchedulerActor::on(ViewTraced&& message) {
  for (auto& [id, session] : sessions_)
    if (session->job && session->job->number() == message.job && session->job->done()) {
      finish_view(*session);
      return;
    }
}

void TileSchedulerActor::on(Tick&&) {
  schedule_tick();
  for (Session* session : by_last_look()) update(*session);
  regroup();
  for (auto& [id, stream] : streams_) {
    if (pictures_came_ || stream->ungranted) grant(*stream);
    choose_together(*stream);
    if (stream->key_put_off) force_key(*stream);
    compose(*stream);
  }
  pictures_came_ = false;
  if (work_changed_) send_work_soon();
  record_errors();
}

// A session's part of a tick.
void TileSchedulerActor::update(Session& session) {
  if (session.job && session.job->done()) finish_view(session);  // its ViewTraced found a full mailbox
  session.pictures_since = session.pictures_since || pictures_came_;
  const bool expired = session.set.expire(now_us());
  const bool reweigh =
      session.demand.crowded && session.pictures_since && now_us() - session.weighed_at >= options_.reweigh_interval;
  if (session.stream && (expired || reweigh)) reallocate(session);
  if (session.view_layer && session.view_layer->expire(now_us())) reallocate_view(session);
  start_view(session);
  if (session.view_key_put_off) force_view_key(session);
  compose_view(session);
}

// Whoever was looked at longest ago comes first, so that none waits for more than a round of all.
std::vector<TileSchedulerActor::Session*> TileSchedulerActor::by_last_look() {
  std::vector<Session*> all;
  all.reserve(sessions_.size());
  for (const auto& [id, session] : sessions_) all.push_back(session.get());
  std::ranges::stable_sort(all, {}, &Session::last_start);
  return all;
}

int TileSchedulerActor::passes_due(Session& session, bool moved) {
  if (moved) return options_.passes_moving;
  const int done = session.set.passes();
  if (done >= options_.passes_unlit && !looking_.allows(now_us())) return 0;
  const bool unlit = session.demand.lit < options_.lit && done >= options_.passes_unlit;
  if (unlit && ++session.updates_waited < options_.updates_unlit) return 0;
  session.updates_waited = 0;
  return std::min(options_.passes_still, kAllPasses - done);
}

// Whoever looks at the very same picture, and knows or is finding out more of it, looks for this session too. True if
// there is nothing more to do now. (What depends on the eye comes of a look of its own.)
bool TileSchedulerActor::look_with_another(Session& session) {
  if (session.view_layer || session.job || !session.view) return false;
  const bool moved = !session.posed || !same_view(*session.posed, *session.view);
  const int done = moved ? 0 : session.set.passes();
  if (done >= kAllPasses) return false;
  const Session* best = nullptr;
  int most = done;
  bool looking = false;
  for (const auto& [id, other] : sessions_) {
    if (other.get() == &session || !other->posed || !same_view(*other->posed, *session.view)) continue;
    looking = looking || other->job != nullptr;
    const int passes = other->job && other->job->starts_pose ? 0 : other->set.passes();
    if (passes <= most) continue;
    best = other.get();
    most = passes;
  }
  if (best == nullptr) return looking;
  auto answer = answer_to(*session.view);
  answer.stamps.view_started = now_us();
  if (session.view->sequence <= session.taken_up) answer.sequence = 0;
  session.taken_up = session.view->sequence;
  session.last_start = answer.stamps.view_started;
  if (moved) session.posed = session.view;
  session.set.adopt(best->set, moved, answer.stamps.view_started);
  know_view(session, answer);
  return true;
}

// Begins the next trace of a session's newest view, if there is something to find out.
void TileSchedulerActor::start_view(Session& session) {
  if (session.job || !session.view || look_with_another(session)) return;
  const bool moved = !session.posed || !same_view(*session.posed, *session.view);
  const int done = moved ? 0 : session.set.passes();
  const int count = passes_due(session, moved);
  const bool unanswered = session.view->sequence > session.taken_up;
  session.taken_up = session.view->sequence;
  auto answer = answer_to(*session.view);
  answer.stamps.view_started = now_us();
  if (count <= 0) {
    if (!unanswered) return;
    answer.stamps.view_ready = now_us();
    session.answer = answer;
    if (session.stream) compose(*session.stream);
    return;
  }
  session.last_start = now_us();
  auto job = std::make_shared<ViewJob>(next_job_++, layout_, rays_, session.view->camera, session.view->viewport, done,
                                       count, 2 * executor().workers(), session.view_layer ? view_materials_ : nullptr);
  job->answer = answer;
  if (!unanswered) job->answer.sequence = 0;
  job->starts_pose = moved;
  session.posed = session.posed && !moved ? session.posed : session.view;
  session.job = job;
  looking_.begin(job->rays(), session.last_start);
  post_slices(job);
}

void TileSchedulerActor::post_slices(const std::shared_ptr<ViewJob>& job) {
  for (unsigned slice = 0; slice < job->slice_count(); ++slice) post_step(executor(), job, slice, self());
}

void TileSchedulerActor::finish_view(Session& session) {
  const auto job = std::exchange(session.job, nullptr);
  const auto traced = now_us();
  looking_.end(job->rays(), job->busy());
  metrics_.observe("darm_view_trace_seconds", double(traced - job->answer.stamps.view_started) * 1e-6);
  if (job->starts_pose) session.set.start_pose(traced, passes_per_picture(session.posed->viewport));
  for (const auto& part : job->results()) session.set.add(part, 0);
  session.set.add(VisibleSet(), job->pass_count());
  if (session.view_layer) {
    if (job->starts_pose) session.view_layer->start_pose(traced);
    for (const auto& part : job->private_results()) session.view_layer->add(part);
    reallocate_view(session);
  }
  know_view(session, job->answer);
  for (auto& [id, other] : sessions_)
    if (other->view && session.posed && same_view(*other->view, *session.posed)) look_with_another(*other);
}

// There is more in the session's set: work and frames follow from it.
void TileSchedulerActor::know_view(Session& session, ViewAnswer answer) {
  if (session.stream)
    reallocate(session);
  else
    place(session);
  send_work_soon();
  answer.stamps.view_ready = now_us();
  if (answer.sequence != 0) session.answer = answer;
  compose(*session.stream);
}

// The session's set has changed, or what its pictures show: slots are chosen anew.
void TileSchedulerActor::reallocate(Session& session) {
  auto chains = session.set.chains();
  groups_.put(session.id, session.format.shared_format(), significant_tiles(chains, options_.significant));
  auto& stream = *session.stream;
  const bool was_crowded = stream.crowded();
  stream.sharp.remove(session.sharp);
  session.sharp = sharp_tiles(chains);
  stream.sharp.add(session.sharp);
  if (stream.crowded()) {
    session.seen = seen_by(session.set, std::move(chains), true, images(), coarse_.get(), layout_->coarse_level());
    if (!was_crowded) return settle(stream);
    choose_together(stream);
  } else {
    choose_alone(session, std::move(chains));
    if (was_crowded) settle(stream);
  }
}

void TileSchedulerActor::send_work() {
  const auto started = now_us();
  work_changed_ = false;
  std::vector<const std::vector<renderer::TileRequest>*> views;
  for (const auto& [id, session] : sessions_) views.push_back(&session->demand.requests);
  auto work = std::make_shared<const std::vector<renderer::TileRequest>>(join_requests(views));
  renderer::ShadeTiles message(std::move(work), next_working_set_++);
  for (const auto& [id, session] : sessions_)
    message.coarse.insert(message.coarse.end(), session->demand.coarse.begin(), session->demand.coarse.end());
  peers_->renderer().tell(std::move(message));
  work_after_ = now_us() + (now_us() - started) * kWorkPause;
}

// Joining what many views ask for takes its time: then a later view's is sent together with those after it.
void TileSchedulerActor::send_work_soon() {
  work_changed_ = true;
  if (now_us() >= work_after_) send_work();
}

// One observation a view and update: quantiles over views, and the worst of now.
void TileSchedulerActor::record_errors() {
  double worst = 0;
  std::size_t done = 0;
  for (const auto& [id, session] : sessions_) {
    if (!session->posed) continue;
    metrics_.observe("darm_view_error", double(session->error));
    worst = std::max(worst, double(session->error));
    done += session->error <= session->target_error ? 1 : 0;
  }
  metrics_.set("darm_view_error_worst", worst);
  metrics_.set("darm_views_on_target", double(done));
}

}  // namespace darm::tile_scheduler
