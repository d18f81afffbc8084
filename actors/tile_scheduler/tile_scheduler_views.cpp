// The private layer of each session: light that depends on its eye.
#include <algorithm>
#include <utility>

#include "actors/tile_scheduler/tile_scheduler_actor.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr double kWeighingLearned = 0.1;  // weight of the newest

}  // namespace

void TileSchedulerActor::open_view(Session& session) {
  StreamOptions stream = options_.stream;
  stream.refine_interval = options_.view_refine_interval;
  session.view_layer.emplace(session.format.view_format(), stream, options_.view);
}

// Once the session has its place among the streams.
void TileSchedulerActor::name_view(Session& session) {
  session.view_stream_id = StreamId{next_stream_++};
  peers_->set_receivers(session.view_stream_id, {session.id});
}

void TileSchedulerActor::close_view(Session& session) {
  if (!session.view_layer) return;
  peers_->view_renderer().tell(renderer::ShadeView(session.id, glm::vec3(0.0f), 0.0f, nullptr));
  if (session.view_stream_id != StreamId{}) peers_->set_receivers(session.view_stream_id, {});
  if (session.view_encoder) peers_->destroy_encoder(session.view_stream_id, session.view_encoder);
}

// A new eye has all its private tiles chosen, made and shaded again: where there are many, each is served less often.
bool TileSchedulerActor::view_due(const Session& session) const {
  if (sessions_.size() < 2) return true;
  const double each = std::max(view_weighing_us_ / options_.weighing_views, double(options_.view_interval));
  return now_us() - session.view_weighed_at >= static_cast<Microseconds>(each * double(sessions_.size()));
}

void TileSchedulerActor::see_own(Session& session, const ViewJob& job) {
  if (job.private_results().empty()) return;
  auto& layer = *session.view_layer;
  if (!session.view_posed || !same_view(*session.view_posed, *session.posed)) layer.start_pose(now_us());
  session.view_posed = session.posed;
  for (const auto& part : job.private_results()) layer.add(part);
  session.view_unweighed = true;
  reallocate_view(session);
}

// Chooses private tiles for what the eye sees, and has them shaded for where it is.
void TileSchedulerActor::reallocate_view(Session& session) {
  if (!view_due(session)) return;
  const auto started = now_us();
  session.view_weighed_at = started;
  session.view_unweighed = false;
  auto& layer = *session.view_layer;
  const bool had = layer.target_size() > 0;
  layer.reallocate(options_.allocation, layout_->coarse_level());
  metrics_.observe("darm_view_allocation_seconds", double(now_us() - started) * 1e-6);
  metrics_.observe("darm_view_private_tiles", double(layer.target_size()));
  if (layer.target_size() > 0 || had) send_view_work(session);
  view_weighing_us_ += kWeighingLearned * (double(now_us() - started) - view_weighing_us_);
}

// Until CoarseTex is there nobody has a picture at all, and the cores are the shared light's.
void TileSchedulerActor::send_view_work(const Session& session) {
  if (coarse_ == nullptr || !session.view_posed) return;
  const glm::vec3 eye(session.view_posed->camera.position - rays_->scene().origin);
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
  if (session.view_layer->stream().in_flight() && !session.view_encoder) session.view_layer->stream().encoder_gone();
  if (!session.link.ready(now_us())) return;
  auto step = session.view_layer->step(now_us(), view_pace_.interval(view_streams_, false));
  if (!step.frame) return;
  step.frame->errors = {session.told};
  step.frame->most_bytes = session.link.most_bytes(step.frame->key) / 2;  // the shared light has the other half
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
