// Streams: who shares one, how their slots are chosen, when a frame goes out.
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "actors/tile_scheduler/tile_scheduler_actor.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr double kLongestUnchosenUs = 1e6;
// Weight of the newest key frame: one that has no tiles yet says little.
constexpr double kLearnedOfLarger = 0.5;
constexpr double kLearnedOfSmaller = 0.02;

}  // namespace

// After its first look a session's stream is known. Before, it could be sent nothing anyway.
void TileSchedulerActor::place(Session& session) {
  session.grouped_at = now_us();
  const auto id = groups_.put(session.id, session.format.shared_format(),
                              significant_tiles(chains_of(session.set.seen()), options_.significant));
  if (streams_.contains(id)) metrics_.count("darm_stream_joins_total");
  enter(session, id);
  settle(*session.stream);
  if (session.view_layer) name_view(session);
}

// What the session sees has changed: does it still belong where it is?
void TileSchedulerActor::group(Session& session) {
  session.ungrouped = true;
  if (now_us() - session.grouped_at < options_.groups.plan_every) return;
  session.grouped_at = now_us();
  session.ungrouped = false;
  groups_.put(session.id, session.format.shared_format(),
              significant_tiles(chains_of(session.set.seen()), options_.significant));
}

void TileSchedulerActor::enter(Session& session, StreamId id) {
  auto& stream = streams_[id];
  if (!stream) {
    const auto format = session.format.shared_format();
    stream = std::make_unique<Stream>(id, format, options_.stream);
    stream->encoder = peers_->make_encoder(id, format);
  }
  stream->members.insert(std::ranges::lower_bound(stream->members, session.id, {}, &Session::id), &session);
  session.stream = stream.get();
  if (known_share(session.set.current(), stream->known) < options_.known) stream->changed_at = now_us();
  session.awaits_key = session.unchosen = true;
  if (stream->members.size() == 2) gather(*stream);
  if (stream->members.size() > 2) note_seen(session);
  peers_->set_receivers(id, groups_.members(id));
  metrics_.set("darm_streams", double(streams_.size()));
}

// A stream goes with its last member.
void TileSchedulerActor::leave(Session& session) {
  if (session.stream == nullptr) return;
  auto& stream = *std::exchange(session.stream, nullptr);
  if (auto open = stream.state.forget_session(session.id); open && !session.answer) session.answer = open;
  std::erase(stream.members, &session);
  session.unchosen = false;
  stream.together.note_change();
  if (!stream.shared()) stream.together.clear();
  peers_->set_receivers(stream.id, groups_.members(stream.id));
  if (!stream.members.empty()) return;
  peers_->destroy_encoder(stream.id, stream.encoder);
  streams_.erase(stream.id);
  metrics_.set("darm_streams", double(streams_.size()));
}

// A client that does not keep up goes to a stream of such clients, because its key frames are everybody's.
void TileSchedulerActor::settle_link(Session& session) {
  if (!session.link.settle(key_bytes_, now_us())) return;
  const auto before = std::exchange(session.format.lane, session.link.lane());
  session.grouped_at = 0;
  session.ungrouped = true;
  if (before == 0)
    metrics_.count("darm_sessions_set_apart_total");
  else if (session.format.lane == 0)
    metrics_.count("darm_sessions_taken_back_total");
}

// A frame would only wait behind others on the way to a member. One that has had no room for long is not waited for,
// where there are others.
bool TileSchedulerActor::held(const Stream& stream) const {
  if (!stream.follows_links()) return false;
  const auto now = now_us();
  return std::ranges::any_of(stream.members, [&](const Session* member) {
    return !member->link.ready(now) && (!stream.shared() || member->link.worth_waiting_for(now));
  });
}

// What suits the slowest link of a stream that follows links; 0: any number.
std::size_t TileSchedulerActor::most_bytes(const Stream& stream, bool key) const {
  std::size_t most = 0;
  if (!stream.follows_links()) return most;
  for (const auto* member : stream.members)
    if (const auto own = member->link.most_bytes(key); own > 0) most = most == 0 ? own : std::min(most, own);
  return most;
}

// All streams of slow links together count as one, so that however many there are, the others have theirs.
Microseconds TileSchedulerActor::frame_interval(const Stream& stream, bool moving) const {
  const auto is_slow = [](const auto& entry) { return entry.second->format.lane > 0; };
  const auto slow = static_cast<std::size_t>(std::ranges::count_if(streams_, is_slow));
  const auto others = streams_.size() - slow;
  const auto interval = pace_.interval(others + std::min<std::size_t>(slow, 1), moving);
  return stream.format.lane > 0 ? pace_.interval((others + 1) * slow, moving) : interval;
}

void TileSchedulerActor::note_sent(Stream& stream, const FrameDone& done) {
  if (!done.ok) return;
  if (done.key && !done.limited && stream.format.lane == 0) {
    const auto bytes = static_cast<double>(done.bytes);
    key_bytes_ += (bytes > key_bytes_ ? kLearnedOfLarger : kLearnedOfSmaller) * (bytes - key_bytes_);
  }
  if (!stream.follows_links()) return;
  for (auto* member : stream.members) member->link.sent(done.bytes, now_us());
}

// Sessions go where groups_ has put them. Whoever goes keeps its picture until the key frame of the other stream is in.
void TileSchedulerActor::regroup() {
  std::set<StreamId> touched;
  const auto started = now_us();
  for (const auto& move : groups_.regroup(started)) {
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
  metrics_.observe("darm_regroup_seconds", double(now_us() - started) * 1e-6);
}

// Members have come or gone.
void TileSchedulerActor::settle(Stream& stream) {
  work_changed_ = true;
  stream.unchosen = true;
  choose_if_due(stream);
}

// What a session sees counts among what all of its stream see.
MemberLook TileSchedulerActor::look_of(const Session& session) {
  const bool rests = session.set.passes() > 0;
  // While a first look from a new place is under way the set is still of the place before.
  const bool from_there = session.posed && !(session.job && session.job->starts_pose);
  return {from_there ? &*session.posed : nullptr, &session.set.current(), rests ? SharedSet::kRests : 1.0f};
}

void TileSchedulerActor::note_seen(Session& session) {
  const auto look = look_of(session);
  session.stream->together.add(*look.samples, look.looks);
}

// Forgets what nobody has seen for a while.
void TileSchedulerActor::gather(Stream& stream) {
  const auto began = executor().thread_time();
  stream.together.renew(now_us());
  std::vector<MemberLook> looks;
  for (const auto* member : stream.members)
    if (member->set.current().samples() > 0) looks.push_back(look_of(*member));
  for (const auto& look : join_same_views(looks)) stream.together.add(*look.samples, look.looks);
  const auto took = (executor().thread_time() - began).count();
  stream.together.renewed(took, now_us());
  metrics_.observe("darm_stream_gather_seconds", double(took) * 1e-6);
}

void TileSchedulerActor::choose_if_due(Stream& stream) {
  if (stream.unchosen && now_us() >= stream.choose_after) choose(stream);
}

Moves TileSchedulerActor::moves_of(const Stream& stream) const {
  if (now_us() - stream.changed_at < options_.rests_after) return Moves::kFreely;
  const auto rested = now_us() - std::max(stream.changed_at, stream.unlit_at);
  return rested < options_.rested_after ? Moves::kFew : Moves::kHardlyAny;
}

// Chooses slots for what the members see together, and what is shaded for them.
void TileSchedulerActor::choose(Stream& stream) {
  const auto started = executor().thread_time();
  if (stream.shared() && stream.together.stale(now_us())) gather(stream);
  const auto rests = [](const Session* member) { return member->set.passes() >= kTapPasses; };
  const auto seen = stream.shared() ? stream.together.seen(std::ranges::all_of(stream.members, rests))
                                    : stream.members.front()->set.seen();
  stream.demand =
      demand_of(seen, *layout_, stream.state.table(), images(), coarse_.get(), options_.allocation, moves_of(stream));
  stream.known.clear();
  for (const auto& item : stream.demand.chains) stream.known.insert(item.chain);
  set_targets(stream);
  for (const auto tile : stream.demand.target.tiles) images_.touch(tile);
  for (auto* member : stream.members) member->unchosen = false;
  stream.unchosen = stream.ungranted = stream.pictures_since = false;
  stream.weighed_at = now_us();
  if (stream.demand.lit < options_.lit) stream.unlit_at = stream.weighed_at;
  work_changed_ = true;
  metrics_.observe("darm_view_tiles", double(stream.demand.target.tiles.size()));
  note_chosen(stream, started);
  send_work_soon();
}

// As exact as the most exacting member that sees a tile.
void TileSchedulerActor::set_targets(Stream& stream) const {
  const auto [least, most] = std::ranges::minmax(stream.members, {}, &Session::target_error);
  for (auto& request : stream.demand.requests) request.target_error = most->target_error;
  if (least->target_error == most->target_error) return;
  for (auto& request : stream.demand.requests)
    for (const auto* member : stream.members)
      if (member->target_error < request.target_error && member->set.current().find(request.tile) != nullptr)
        request.target_error = member->target_error;
}

// Choosing took the processor so long, until now. It comes before light, so where there are several clients it must
// leave time.
void TileSchedulerActor::note_chosen(Stream& stream, std::chrono::microseconds started) {
  const auto took = double((executor().thread_time() - started).count());
  metrics_.observe("darm_allocation_seconds", took * 1e-6);
  if (sessions_.size() < 2) return;
  const double pause = std::min(took * double(streams_.size()) / options_.weighing, kLongestUnchosenUs);
  stream.choose_after = now_us() + static_cast<Microseconds>(pause);
}

// Pictures have come: what can be had now?
void TileSchedulerActor::grant(Stream& stream) {
  if (now_us() < stream.choose_after) return;
  const auto started = executor().thread_time();
  stream.ungranted = false;
  grant_available(stream.demand, layout_->coarse_level(), stream.state.table(), images(), options_.allocation);
  note_chosen(stream, started);
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
  if (stream.state.in_flight()) {
    if (stream.shared()) answer_meanwhile(stream);
    return;
  }
  if (held(stream)) return answer_meanwhile(stream);
  if (stream.asked_at == 0) stream.asked_at = started;
  const bool waits_for_pictures = stream.demand.granted.tiles.empty() && !stream.demand.target.tiles.empty();
  const bool first = stream.state.last_frame() == 0;
  if (first && waits_for_pictures && started - stream.asked_at < options_.first_frame_wait) return;
  admit(stream, started);
  bool moving = false;
  for (auto* member : stream.members) {
    moving = moving || member->set.passes() < options_.passes_unlit;
    // What it does not have a key frame for, or no slots, it cannot be told of yet.
    if (!member->answer || member->awaits_key || member->unchosen) continue;
    stream.state.view_ready(*std::exchange(member->answer, std::nullopt));
  }
  estimate_errors(stream);
  auto step = stream.state.step(stream.demand.granted.tiles, images(), light_error(stream), started,
                                frame_interval(stream, moving));
  for (const auto& answer : step.no_change) tell_no_change(answer);
  note_slots(stream, step);
  if (step.frame) {
    for (const auto* member : stream.members) step.frame->errors.push_back(member->told);
    step.frame->most_bytes = most_bytes(stream, step.frame->key);
    send_frame(stream, std::move(*step.frame));
  }
  metrics_.observe("darm_frame_plan_seconds", double(now_us() - started) * 1e-6);
}

// What oversubscription does: how long tiles wait for a slot, and how many lose theirs.
void TileSchedulerActor::note_slots(Stream& stream, const StreamStep& step) {
  // Not at every step, of which a stream of many has hundreds a second: it looks at every tile.
  if (const auto now = now_us(); now - stream.waits_at >= kWaitsEvery) {
    stream.waits_at = now;
    for (const auto waited : stream.waits.update(stream.demand.target.tiles, stream.state.table(), now))
      metrics_.observe("darm_slot_wait_seconds", double(waited) * 1e-6);
  }
  if (!step.frame || step.frame->key) return;
  const auto lost = std::ranges::count(step.frame->edits, kNoSlot, &encoder::PageEdit::slot);
  if (lost > 0) metrics_.count("darm_slot_evictions_total", double(lost));
}

// Where many share a stream there is nearly always a frame under way, and where links are full none comes for a while:
// nobody waits for it.
void TileSchedulerActor::answer_meanwhile(Stream& stream) {
  for (auto* member : stream.members) {
    if (!member->answer || member->awaits_key || member->unchosen) continue;
    if (stream.state.answers_in_flight(member->id)) continue;  // it is answered in order
    tell_no_change(*std::exchange(member->answer, std::nullopt));
  }
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
