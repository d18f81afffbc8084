#include "actors/tile_scheduler/tile_scheduler_actor.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace darm::tile_scheduler {
namespace {

constexpr Microseconds kLongestViewPause = 10'000'000;  // of a private layer among many
constexpr Microseconds kWorkPause = 4;                  // times as long as it took

Microseconds period_of(double updates_per_second) {
  const double rate = std::isfinite(updates_per_second) ? std::clamp(updates_per_second, 0.1, 1000.0) : 10.0;
  return static_cast<Microseconds>(1e6 / rate);
}

}  // namespace

TileSchedulerActor::TileSchedulerActor(runtime::Context<tile_scheduler::Inbox> context,
                                       std::shared_ptr<const atlas::Layout> layout,
                                       std::shared_ptr<const renderer::trace::RayScene> rays,
                                       std::shared_ptr<const Peers> peers, SchedulerOptions options,
                                       runtime::MetricSink& metrics,
                                       std::shared_ptr<const std::vector<scene::ViewMaterial>> materials)
    : Actor(std::move(context)),
      layout_(std::move(layout)),
      rays_(std::move(rays)),
      peers_(std::move(peers)),
      options_(options),
      metrics_(metrics),
      period_(period_of(options.updates_per_second)),
      near_(options.near * double(glm::distance(rays_->scene().bounds_min, rays_->scene().bounds_max))),
      looking_(options.looking * executor().workers(), options.glancing * executor().workers()),
      pace_(options.coding * executor().workers()),
      view_pace_(options.coding_views * executor().workers(), kLongestViewPause),
      images_(options.image_bytes),
      groups_(options.groups, [this] { return StreamId{next_stream_++}; }) {
  if (materials && materials->size() == layout_->instances.size()) materials_ = std::move(materials);
  view_layers_ = materials_ && peers_->view_renderer && scene::calls_for_view_layer(*materials_);
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
  session->told.session = session->id;
  if (view_layers_ && message.format.view_phystex > 0) open_view(*session);
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
  send_work_soon();  // what only this session saw is no longer shaded
}

void TileSchedulerActor::on(ViewChanged&& message) {
  auto* session = find(message.session);
  if (session == nullptr || !is_valid(message.camera) || !is_valid(message.viewport)) return;
  if (session->view && message.sequence <= session->view->sequence) return;
  if (!session->view || !same_view(*session->view, message)) session->moved_at = now_us();
  session->view = std::move(message);
  // A camera that rests since the last update is looked at right away, not only at the next tick.
  if (now_us() - session->last_start >= period_ || seen_by_others(*session)) start_view(*session);
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
  if (message.behind) session->link.lost_pictures(now_us());
  force_key(*session->stream);
  if (session->stream->key_put_off)
    metrics_.count("darm_key_frames_put_off_total", 1);
  else
    compose(*session->stream);
}

void TileSchedulerActor::on(LinkChanged&& message) {
  auto* session = find(message.session);
  if (session == nullptr) return;
  session->link.changed(message.state, message.bytes_per_second, now_us());
  if (session->stream == nullptr || !session->link.ready(now_us())) return;
  if (session->stream->follows_links()) compose(*session->stream);
  compose_view(*session);
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
  // Clients show it at once, and the next frame may be long in coming: they are told what is to be told of it, in
  // answer to no camera.
  for (auto& [id, stream] : streams_) {
    estimate_errors(*stream, 0);
    tell_errors(*stream);
  }
  for (auto& [id, session] : sessions_)
    if (session->view_layer) send_view_work(*session);
}

void TileSchedulerActor::on(FrameDone&& message) {
  if (const auto it = streams_.find(message.stream); it != streams_.end()) {
    auto& stream = *it->second;
    pace_.done(message.busy);
    stream.state.frame_done(message.frame, message.ok, message.settled);
    note_sent(stream, message);
    if (stream.untold) tell_errors(stream);
    const auto waits = [](const Session* member) { return member->answer.has_value(); };
    if (stream.state.has_answers() || std::ranges::any_of(stream.members, waits)) compose(stream);
    return;
  }
  view_pace_.done(message.busy);
  for (auto& [id, session] : sessions_)
    if (session->view_layer && session->view_stream_id == message.stream) {
      session->view_layer->stream().frame_done(message.frame, message.ok, message.settled);
      session->link.sent(message.bytes, now_us());
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
  count_moving();
  for (Session* session : by_last_look()) update(*session);
  regroup();
  for (auto& [id, stream] : streams_) {
    stream->pictures_since = stream->pictures_since || pictures_came_;
    stream->ungranted = stream->ungranted || pictures_came_;
    const bool reweigh = stream->demand.crowded && stream->pictures_since &&
                         now_us() - stream->weighed_at >= options_.reweigh_interval << stream->reweighed;
    if (reweigh) stream->reweighed = std::min(stream->reweighed + 1, kMostReweighed);
    if (reweigh || (stream->shared() && stream->together.stale(now_us()))) stream->unchosen = true;
    choose_if_due(*stream);
    if (stream->ungranted) grant(*stream);
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
  if (session.set.expire(now_us()) && session.stream) session.stream->unchosen = true;
  settle_link(session);
  if (session.stream && session.ungrouped) group(session);
  if (session.view_layer && session.view_layer->expire(now_us())) session.view_unweighed = true;
  if (session.view_unweighed) reallocate_view(session);
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

void TileSchedulerActor::send_work() {
  const auto started = executor().thread_time();
  work_changed_ = false;
  std::vector<const std::vector<renderer::TileRequest>*> views;
  for (const auto& [id, stream] : streams_) views.push_back(&stream->demand.requests);
  auto work = std::make_shared<const std::vector<renderer::TileRequest>>(join_requests(views));
  renderer::ShadeTiles message(std::move(work), next_working_set_++);
  for (const auto& [id, stream] : streams_)
    message.coarse.insert(message.coarse.end(), stream->demand.coarse.begin(), stream->demand.coarse.end());
  peers_->renderer().tell(std::move(message));
  work_after_ = now_us() + (executor().thread_time() - started).count() * kWorkPause;
}

// Joining what many views ask for takes its time: then a later view's is sent together with those after it.
void TileSchedulerActor::send_work_soon() {
  work_changed_ = true;
  if (now_us() >= work_after_) send_work();
}

}  // namespace darm::tile_scheduler
