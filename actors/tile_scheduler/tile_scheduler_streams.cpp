// Streams: who shares one, how their slots are chosen, when a frame goes out.
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "actors/tile_scheduler/tile_scheduler_actor.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr Microseconds kErrorEvery = 30'000;

}  // namespace

// After its first look a session's stream is known. Before, it could be sent nothing anyway.
void TileSchedulerActor::place(Session& session) {
  const auto chains = session.set.chains();
  session.sharp = sharp_tiles(chains);
  const auto id =
      groups_.put(session.id, session.format.shared_format(), significant_tiles(chains, options_.significant));
  if (streams_.contains(id)) metrics_.count("darm_stream_joins_total");
  enter(session, id);
  settle(*session.stream);
  if (session.view_layer) name_view(session);
}

void TileSchedulerActor::enter(Session& session, StreamId id) {
  auto& stream = streams_[id];
  if (!stream) {
    const auto format = session.format.shared_format();
    stream = std::make_unique<Stream>(id, format, options_.stream);
    stream->encoder = peers_->make_encoder(id, format);
  }
  stream->members.insert(std::ranges::lower_bound(stream->members, session.id, {}, &Session::id), &session);
  stream->sharp.add(session.sharp);
  session.stream = stream.get();
  session.awaits_key = true;
  peers_->set_receivers(id, groups_.members(id));
  metrics_.set("darm_streams", double(streams_.size()));
}

// A stream goes with its last member.
void TileSchedulerActor::leave(Session& session) {
  if (session.stream == nullptr) return;
  auto& stream = *std::exchange(session.stream, nullptr);
  if (auto open = stream.state.forget_session(session.id); open && !session.answer) session.answer = open;
  std::erase(stream.members, &session);
  stream.sharp.remove(session.sharp);
  stream.wanted.remove(std::exchange(session.wanted, {}));
  session.granted_new = true;
  stream.joint = {};  // its numbers were those of the members before
  peers_->set_receivers(stream.id, groups_.members(stream.id));
  if (!stream.members.empty()) return;
  peers_->destroy_encoder(stream.id, stream.encoder);
  streams_.erase(stream.id);
  metrics_.set("darm_streams", double(streams_.size()));
}

// Sessions go where groups_ has put them. Whoever goes keeps its picture until the key frame of the other stream is in.
void TileSchedulerActor::regroup() {
  std::set<StreamId> touched;
  for (const auto& move : groups_.regroup(now_us())) {
    auto* session = find(move.session);
    if (session == nullptr || session->stream == nullptr || session->stream->id == move.to) continue;
    touched.insert(session->stream->id);
    touched.insert(move.to);
    leave(*session);
    enter(*session, move.to);
    metrics_.count(move.split ? "darm_stream_splits_total" : "darm_stream_joins_total");
  }
  for (const auto id : touched)
    if (const auto it = streams_.find(id); it != streams_.end()) settle(*it->second);
}

// Members have come or gone, or their sets have begun or ceased to fit: slots are chosen as that asks for.
void TileSchedulerActor::settle(Stream& stream) {
  work_changed_ = true;
  if (!stream.crowded()) {
    for (auto* member : stream.members)
      if (member->seen || member->demand.joint || member->demand.chains.empty())
        choose_alone(*member, member->set.chains());
    return;
  }
  for (auto* member : stream.members)
    if (!member->seen)
      member->seen = seen_by(member->set, member->set.chains(), true, images(), coarse_.get(), layout_->coarse_level());
  stream.allocate_after = 0;
  choose_together(stream);
}

void TileSchedulerActor::note_weighed(Session& session) {
  for (auto& request : session.demand.requests) request.target_error = session.target_error;
  session.weighed_at = now_us();
  session.pictures_since = false;
  for (const auto tile : session.demand.target.tiles) images_.touch(tile);
  session.granted_new = true;
  work_changed_ = true;
  metrics_.observe("darm_view_tiles", double(session.demand.target.tiles.size()));
}

// Where all sharp tiles fit, and where there is one view, it needs nothing of others.
void TileSchedulerActor::choose_alone(Session& session, std::vector<WeightedChain> chains) {
  const auto started = now_us();
  const auto& table = session.stream->state.table();
  session.seen.reset();
  session.demand = demand_of(session.set, std::move(chains), session.sharp.size() > table.capacity(), *layout_, table,
                             images(), coarse_.get(), options_.allocation);
  note_weighed(session);
  metrics_.observe("darm_allocation_seconds", double(now_us() - started) * 1e-6);
}

// Chooses slots for all members of a crowded stream, if there is a newer view among them. It takes as long for all as
// for one, and a time that grows with them: so the next one waits for some.
void TileSchedulerActor::choose_together(Stream& stream) {
  const auto started = now_us();
  if (!stream.crowded() || started < stream.allocate_after) return;
  if (std::ranges::none_of(stream.members, [](const Session* m) { return m->seen.has_value(); })) return;
  std::vector<ViewDemand*> views;
  for (auto* member : stream.members) {
    if (member->seen) member->demand = std::move(*member->seen);
    member->seen.reset();
    views.push_back(&member->demand);
  }
  stream.joint = join_views(std::vector<const ViewDemand*>(views.begin(), views.end()));
  share_slots(views, stream.joint, stream.state.table(), images(), layout_->coarse_level(), options_.allocation);
  for (auto* member : stream.members) {
    member->demand.requests = requests_of(member->set, *layout_, member->demand);
    if (coarse_ == nullptr) member->demand.coarse = coarse_texels_seen(member->set.current(), *layout_);
    note_weighed(*member);
  }
  stream.ungranted = false;
  note_chosen(stream, started);
}

// Choosing for all members took so long, until now.
void TileSchedulerActor::note_chosen(Stream& stream, Microseconds started) {
  const auto took = double(now_us() - started);
  const auto crowded = std::ranges::count_if(streams_, [](const auto& entry) { return entry.second->crowded(); });
  stream.allocate_after = now_us() + static_cast<Microseconds>(took * double(crowded) / options_.weighing);
  metrics_.observe("darm_allocation_seconds", took * 1e-6);
}

// Pictures have come: what can be had now?
void TileSchedulerActor::grant(Stream& stream) {
  const auto level = layout_->coarse_level();
  const auto started = now_us();
  stream.ungranted = stream.crowded() && started < stream.allocate_after;
  if (stream.ungranted) return;
  if (stream.crowded() && stream.joint.number.size() == stream.members.size()) {
    std::vector<ViewDemand*> views;
    for (auto* member : stream.members) views.push_back(&member->demand);
    share_available(views, stream.joint, stream.state.table(), images(), level, options_.allocation);
    for (auto* member : stream.members) member->granted_new = true;
    return note_chosen(stream, started);
  }
  for (auto* member : stream.members) {
    if (member->demand.joint) continue;
    const auto before = member->demand.granted.tiles;
    grant_available(member->demand, level, stream.state.table(), images(), options_.allocation);
    member->granted_new = member->granted_new || before != member->demand.granted.tiles;
  }
}

// Makes the next frame a key frame, unless there was one on demand just now: then a later tick does.
void TileSchedulerActor::force_key(Stream& stream) {
  stream.key_put_off = stream.key_forced_at && now_us() - *stream.key_forced_at < options_.key_interval;
  if (stream.key_put_off) return;
  stream.key_forced_at = now_us();
  stream.state.want_key();
}

// Whoever has come since the last key frame is served by the next one. Those come one in join_interval at most, so that
// many who come at once cost the others one.
void TileSchedulerActor::admit(Stream& stream, Microseconds now) {
  const auto awaits = [](const Session* member) { return member->awaits_key; };
  if (!stream.state.key_pending()) {
    if (std::ranges::none_of(stream.members, awaits)) return;
    if (stream.key_at && now - *stream.key_at < options_.join_interval) return;
    stream.state.want_key();
  }
  for (auto* member : stream.members) member->awaits_key = false;
}

void TileSchedulerActor::compose(Stream& stream) {
  const auto started = now_us();
  if (stream.state.in_flight() && !stream.encoder) stream.state.encoder_gone();
  if (stream.state.in_flight()) return;
  if (stream.asked_at == 0) stream.asked_at = started;
  const bool waits_for_pictures = std::ranges::all_of(stream.members, [](const Session* m) {
    return m->demand.granted.tiles.empty() && !m->demand.target.tiles.empty();
  });
  const bool first = stream.state.last_frame() == 0;
  if (first && waits_for_pictures && started - stream.asked_at < options_.first_frame_wait) return;
  admit(stream, started);
  bool moving = false;
  for (auto* member : stream.members) {
    moving = moving || member->set.passes() < options_.passes_unlit;
    // What it does not have a key frame for, or no slots, it cannot be told of yet.
    if (!member->answer || member->awaits_key || member->seen) continue;
    stream.state.view_ready(*std::exchange(member->answer, std::nullopt));
  }
  auto errors = errors_of(stream);
  double squares = 0;
  for (const auto& e : errors) squares += double(e.error) * double(e.error);
  const auto error = static_cast<float>(std::sqrt(squares / double(std::max<std::size_t>(1, errors.size()))));
  auto step = stream.state.step(wanted_of(stream), images(), error, started, pace_.interval(streams_.size(), moving));
  for (const auto& answer : step.no_change) {
    const auto* session = find(answer.session);
    peers_->sessions->find(answer.session).tell(session::NoChange(answer, session ? session->error : error));
  }
  if (step.frame) {
    step.frame->errors = std::move(errors);
    send_frame(stream, std::move(*step.frame));
  }
  metrics_.observe("darm_frame_plan_seconds", double(now_us() - started) * 1e-6);
}

// Granted tiles of all members, those first that show most.
std::span<const TileId> TileSchedulerActor::wanted_of(Stream& stream) {
  if (stream.members.size() == 1) return stream.members.front()->demand.granted.tiles;
  for (auto* member : stream.members) {
    if (!std::exchange(member->granted_new, false)) continue;
    stream.wanted.remove(member->wanted);
    member->wanted.tiles = member->demand.granted.tiles;
    member->wanted.weights = member->demand.granted.weights;
    stream.wanted.add(member->wanted);
  }
  return stream.wanted.list(stream.state.table().capacity());
}

// An error takes a millisecond to know: where many share a stream, each of theirs is looked at less often.
std::vector<encoder::ViewError> TileSchedulerActor::errors_of(const Stream& stream) {
  std::vector<encoder::ViewError> out;
  const auto now = now_us();
  const auto enough = kErrorEvery * static_cast<Microseconds>(stream.members.size() - 1);
  for (auto* member : stream.members) {
    if (!member->error_at || now - *member->error_at >= enough) {
      member->error = view_error(member->demand, images(), layout_->coarse_level(), coarse_ != nullptr);
      member->error_at = now;
    }
    out.push_back({member->id, member->error});
  }
  return out;
}

void TileSchedulerActor::send_frame(Stream& stream, encoder::ComposeFrame frame) {
  metrics_.observe("darm_frame_writes", double(frame.writes.size()));
  metrics_.observe("darm_frame_edits", double(frame.edits.size()));
  metrics_.observe("darm_stream_sessions", double(stream.members.size()));
  std::size_t used = 0;
  for (const auto& [id, other] : streams_) used += other->state.table().size();
  metrics_.set("darm_slots_used", double(used));
  if (frame.key) {
    stream.key_at = now_us();
    stream.key_put_off = false;
  }
  const auto number = frame.frame;
  if (stream.encoder.tell(std::move(frame))) return;
  // The encoder is gone: a new one starts with a key frame, at the next tick.
  stream.encoder = peers_->make_encoder(stream.id, stream.format);
  stream.state.frame_done(number, false);
}

}  // namespace darm::tile_scheduler
