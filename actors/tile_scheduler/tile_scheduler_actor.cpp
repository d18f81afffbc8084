#include "actors/tile_scheduler/tile_scheduler_actor.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace darm::tile_scheduler {
namespace {

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
      images_(options.image_bytes) {
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
  session->stream_id = StreamId{next_stream_++};
  session->encoder = peers_->make_encoder(session->stream_id, message.format);
  peers_->set_receivers(session->stream_id, {message.session});
  if (view_materials_ && message.format.view_phystex > 0) open_view(*session);
  sessions_.emplace(message.session, std::move(session));
}

void TileSchedulerActor::on(SessionClosed&& message) {
  const auto it = sessions_.find(message.session);
  if (it == sessions_.end()) return;
  const auto stream = it->second->stream_id;
  const auto encoder = it->second->encoder;
  close_view(*it->second);
  sessions_.erase(it);
  peers_->set_receivers(stream, {});
  peers_->destroy_encoder(stream, encoder);
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
  force_key(*session);
  if (session->key_put_off)
    metrics_.count("darm_key_frames_put_off_total", 1);
  else if (session->set.passes() > 0)
    compose(*session);
}

// Makes the session's next frame a key frame, unless it had one on demand just now: then a later tick does.
void TileSchedulerActor::force_key(Session& session) {
  session.key_put_off = session.key_forced_at && now_us() - *session.key_forced_at < options_.key_interval;
  if (session.key_put_off) return;
  session.key_forced_at = now_us();
  session.stream.want_key();
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
  for (auto& [id, session] : sessions_) {
    if (session->view_layer && session->view_stream_id == message.stream) {
      session->view_layer->stream().frame_done(message.frame, message.ok, message.settled);
      return;
    }
    if (session->stream_id != message.stream) continue;
    pace_.done(message.busy);
    session->stream.frame_done(message.frame, message.ok, message.settled);
    if (session->stream.has_answers()) compose(*session);
    return;
  }
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
  bool work_changed = false;
  for (Session* session : by_last_look()) {
    if (session->job && session->job->done()) finish_view(*session);  // its ViewTraced found a full mailbox
    session->pictures_since = session->pictures_since || pictures_came_;
    const bool expired = session->set.expire(now_us());
    const bool reweigh = session->demand.crowded && session->pictures_since &&
                         now_us() - session->weighed_at >= options_.reweigh_interval;
    if (expired || reweigh) {
      reallocate(*session);
      work_changed = true;
    } else if (pictures_came_ && session->set.passes() > 0) {
      grant_available(session->demand, layout_->coarse_level(), session->stream.table(), images(), options_.allocation);
    }
    if (session->key_put_off) force_key(*session);
    if (session->view_layer && session->view_layer->expire(now_us())) reallocate_view(*session);
    start_view(*session);
    if (session->set.passes() > 0) compose(*session);
    if (session->view_key_put_off) force_view_key(*session);
    compose_view(*session);
  }
  pictures_came_ = false;
  if (work_changed) send_work();
  record_errors();
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

// Begins the next trace of a session's newest view, if there is something to find out.
void TileSchedulerActor::start_view(Session& session) {
  if (session.job || !session.view) return;
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
    session.stream.view_ready(answer);
    compose(session);
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
  reallocate(session);
  send_work();
  auto answer = job->answer;
  answer.stamps.view_ready = now_us();
  if (answer.sequence != 0) session.stream.view_ready(answer);
  compose(session);
}

void TileSchedulerActor::reallocate(Session& session) {
  const auto started = now_us();
  session.demand =
      demand_of(session.set, *layout_, session.stream.table(), images(), coarse_.get(), options_.allocation);
  for (auto& request : session.demand.requests) request.target_error = session.target_error;
  session.weighed_at = now_us();
  session.pictures_since = false;
  for (const auto tile : session.demand.target.tiles) images_.touch(tile);
  metrics_.observe("darm_allocation_seconds", double(now_us() - started) * 1e-6);
  metrics_.observe("darm_view_tiles", double(session.demand.target.tiles.size()));
}

void TileSchedulerActor::send_work() {
  std::vector<const std::vector<renderer::TileRequest>*> views;
  for (const auto& [id, session] : sessions_) views.push_back(&session->demand.requests);
  auto work = std::make_shared<const std::vector<renderer::TileRequest>>(join_requests(views));
  renderer::ShadeTiles message(std::move(work), next_working_set_++);
  for (const auto& [id, session] : sessions_)
    message.coarse.insert(message.coarse.end(), session->demand.coarse.begin(), session->demand.coarse.end());
  peers_->renderer().tell(std::move(message));
}

void TileSchedulerActor::compose(Session& session) {
  const auto started = now_us();
  if (session.asked_at == 0) session.asked_at = started;
  const bool first = session.stream.last_frame() == 0;
  const bool nothing_yet = session.demand.granted.tiles.empty() && !session.demand.target.tiles.empty();
  if (first && nothing_yet && started - session.asked_at < options_.first_frame_wait) return;
  const float error = view_error(session.demand, images(), layout_->coarse_level(), coarse_ != nullptr);
  session.error = error;
  const bool moving = session.set.passes() < options_.passes_unlit;
  auto step = session.stream.step(session.demand.granted.tiles, images(), error, started,
                                  pace_.interval(sessions_.size(), moving));
  for (const auto& answer : step.no_change)
    peers_->sessions->find(answer.session).tell(session::NoChange(answer, error));
  if (step.frame) send_frame(session, std::move(*step.frame));
  metrics_.observe("darm_frame_plan_seconds", double(now_us() - started) * 1e-6);
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

void TileSchedulerActor::send_frame(Session& session, encoder::ComposeFrame frame) {
  metrics_.observe("darm_frame_writes", double(frame.writes.size()));
  metrics_.observe("darm_frame_edits", double(frame.edits.size()));
  std::size_t used = 0;
  for (const auto& [id, other] : sessions_) used += other->stream.table().size();
  metrics_.set("darm_slots_used", double(used));
  const auto number = frame.frame;
  if (session.encoder.tell(std::move(frame))) return;
  // The encoder is gone: a new one starts with a key frame, at the next tick.
  session.encoder = peers_->make_encoder(session.stream_id, session.format);
  session.stream.frame_done(number, false);
}

// ---- private layers -------------------------------------------------------------------------------------------------

void TileSchedulerActor::open_view(Session& session) {
  session.view_stream_id = StreamId{next_stream_++};
  StreamOptions stream = options_.stream;
  stream.refine_interval = options_.view_refine_interval;
  session.view_layer.emplace(session.format.view_format(), stream, options_.view);
  peers_->set_receivers(session.view_stream_id, {session.id});
}

void TileSchedulerActor::close_view(Session& session) {
  if (!session.view_layer) return;
  peers_->view_renderer().tell(renderer::ShadeView(session.id, glm::vec3(0.0f), 0.0f, nullptr));
  peers_->set_receivers(session.view_stream_id, {});
  if (session.view_encoder) peers_->destroy_encoder(session.view_stream_id, session.view_encoder);
}

// Chooses private tiles for what the eye sees, and has them shaded for where it is.
void TileSchedulerActor::reallocate_view(Session& session) {
  const auto started = now_us();
  auto& layer = *session.view_layer;
  const bool had = layer.target_size() > 0;
  layer.reallocate(options_.allocation, layout_->coarse_level());
  metrics_.observe("darm_view_allocation_seconds", double(now_us() - started) * 1e-6);
  metrics_.observe("darm_view_private_tiles", double(layer.target_size()));
  if (layer.target_size() > 0 || had) send_view_work(session);
}

// Until CoarseTex is there nobody has a picture at all, and the cores are the shared light's.
void TileSchedulerActor::send_view_work(const Session& session) {
  if (coarse_ == nullptr || !session.posed) return;
  const glm::vec3 eye(session.posed->camera.position - rays_->scene().origin);
  peers_->view_renderer().tell(
      renderer::ShadeView(session.id, eye, session.target_error, session.view_layer->requests()));
}

// As force_key(), for the private layer.
void TileSchedulerActor::force_view_key(Session& session) {
  if (!session.view_layer) return;
  const auto last = session.view_key_forced_at;
  session.view_key_put_off = last && now_us() - *last < options_.key_interval;
  if (session.view_key_put_off) return;
  session.view_key_forced_at = now_us();
  session.view_layer->stream().want_key();
  compose_view(session);
}

void TileSchedulerActor::compose_view(Session& session) {
  if (!session.view_layer || session.view_layer->idle()) return;
  auto step = session.view_layer->step(now_us());
  if (!step.frame) return;
  if (!session.view_encoder)
    session.view_encoder = peers_->make_encoder(session.view_stream_id, session.format.view_format());
  std::size_t used = 0;
  for (const auto& [id, other] : sessions_)
    if (other->view_layer) used += other->view_layer->stream().table().size();
  metrics_.set("darm_view_slots_used", double(used));
  metrics_.observe("darm_view_frame_writes", double(step.frame->writes.size()));
  const auto number = step.frame->frame;
  if (session.view_encoder.tell(std::move(*step.frame))) return;
  session.view_encoder = {};  // it is gone: a new one starts with a key frame, at the next tick
  session.view_layer->stream().frame_done(number, false);
}

}  // namespace darm::tile_scheduler
