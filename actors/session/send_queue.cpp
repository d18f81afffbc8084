#include "actors/session/send_queue.hpp"

#include <algorithm>
#include <utility>

namespace darm::session {
namespace {
// Time for a key frame to be made before it is asked for again.
constexpr Microseconds kKeyPatience = 1'000'000;
}  // namespace

void SendQueue::insert_before_bulk(Item item) {
  const auto bulk = std::find_if(items_.begin(), items_.end(), [](const Item& i) { return i.kind == Kind::kBulk; });
  items_.insert(bulk, std::move(item));
}

void SendQueue::push_control(Packet packet) {
  control_waiting_bytes_ += packet.size();
  insert_before_bulk({Kind::kControl, std::move(packet), nullptr, {}, 0, 0});
}

void SendQueue::push_bulk(Packet packet) {
  ++bulk_waiting_;
  items_.push_back({Kind::kBulk, std::move(packet), nullptr, {}, 0, 0});
}

void SendQueue::push_manifest(Packet packet) {
  ++bulk_waiting_;
  items_.push_back({Kind::kManifest, std::move(packet), nullptr, {}, 0, 0});
}

void SendQueue::push_coarse(Packet packet) {
  const auto old = std::find_if(items_.begin(), items_.end(), [](const Item& i) { return i.kind == Kind::kCoarse; });
  if (old != items_.end()) {
    old->packet = std::move(packet);
    return;
  }
  insert_before_bulk({Kind::kCoarse, std::move(packet), nullptr, {}, 0, 0});
}

bool SendQueue::push_picture(const std::shared_ptr<const EncodedFrame>& frame, const ViewAnswer& answer,
                             Microseconds now, bool room) {
  const auto layer = frame->layer;
  auto& mine = track(layer);
  const auto oldest = std::find_if(items_.begin(), items_.end(),
                                   [&](const Item& i) { return i.kind == Kind::kPicture && i.frame->layer == layer; });
  const bool late = oldest != items_.end() && waited(*oldest, now) > limits_.media_age;
  // A single picture may be of any size; only a queue of them is bounded.
  const bool full = mine.waiting > 0 && mine.waiting_bytes + size_of(*frame) > limits_.media_bytes;
  const bool crowded = mine.waiting > 0 && !room;
  if (late || full || crowded) drop_pictures(layer, late ? Drop::kOld : full ? Drop::kFull : Drop::kMemory);
  // A key frame makes what waits before it useless, and stands for it.
  if (frame->key && mine.waiting > 0) drop_pictures(layer, Drop::kReplaced);
  if (!frame->key && frame->stream != mine.stream && !mine.refused) {
    await_key(mine, now);
    return turn_away(answer, Drop::kElsewhere);
  }
  const bool follows = !mine.key_needed && frame->stream == mine.stream && frame->frame == mine.newest + 1;
  if (bulk_waiting_ > 0 || (!frame->key && !follows)) {
    if (frame->key) mine.key_asked.reset();
    mine.key_needed = mine.refused = true;
    return turn_away(answer, bulk_waiting_ > 0 ? Drop::kLoading : Drop::kKeyNeeded);
  }
  mine.key_needed = mine.refused = false;
  mine.key_asked.reset();
  mine.stream = frame->stream;
  mine.newest = frame->frame;
  mine.waiting_bytes += size_of(*frame);
  ++mine.waiting;
  items_.push_back({Kind::kPicture, {}, frame, answer, 0, now});
  return true;
}

bool SendQueue::turn_away(const ViewAnswer& answer, Drop why) {
  note(why);
  keep_answer(answer);
  return false;
}

// Without the time in which a key frame went out before it.
Microseconds SendQueue::waited(const Item& item, Microseconds now) const {
  return key_under_way_ ? 0 : now - std::max(item.since, key_sent_at_);
}

void SendQueue::sent(Microseconds now) {
  under_way_since_.reset();
  if (std::exchange(key_under_way_, false)) key_sent_at_ = now;
}

// Whoever comes to a stream is made a key frame without being asked, together with others who came. It is asked for
// only where that does not come.
void SendQueue::await_key(Track& mine, Microseconds now) {
  if (!mine.key_asked) mine.key_asked = now;
  if (now - *mine.key_asked >= kKeyPatience) mine.key_needed = mine.refused = true;
}

void SendQueue::push_no_change(const NoChange& event) {
  if (track(StreamLayer::kShared).key_needed) {
    keep_answer(event.answer);
    return;
  }
  items_.push_back({Kind::kNoChange, {}, nullptr, event.answer, event.error, 0});
}

void SendQueue::keep_answer(const ViewAnswer& answer) {
  if (answer.sequence > lost_answer_.sequence) lost_answer_ = answer;
}

void SendQueue::attach_lost_answer(ViewAnswer& answer) {
  if (lost_answer_.sequence > answer.sequence) {
    // The later picture shows what the lost one would have; the times of its making are its own.
    auto stamps = lost_answer_.stamps;
    stamps.encode_started = answer.stamps.encode_started;
    stamps.picture_composed = answer.stamps.picture_composed;
    stamps.encoded = answer.stamps.encoded;
    answer.sequence = lost_answer_.sequence;
    answer.stamps = stamps;
  }
  lost_answer_ = {};
}

void SendQueue::drop_pictures(StreamLayer layer, Drop why) {
  const auto goes = [layer](const Item& i) {
    if (i.kind == Kind::kPicture) return i.frame->layer == layer;
    return i.kind == Kind::kNoChange && layer == StreamLayer::kShared;
  };
  for (const auto& i : items_) {
    if (!goes(i)) continue;
    keep_answer(i.answer);
    if (i.kind == Kind::kPicture) note(why);
  }
  std::erase_if(items_, goes);
  auto& mine = track(layer);
  mine.waiting = 0;
  mine.waiting_bytes = 0;
  mine.key_needed = mine.refused = true;
}

Packets SendQueue::take(Microseconds now, const MakePicture& make, const MakeNoChange& make_answer, bool room) {
  if (under_way_since_) return {};
  auto packets = background_next(room) ? take_background() : take_messages(now, make, make_answer);
  if (!packets.empty()) under_way_since_ = now;
  return packets;
}

bool SendQueue::background_next(bool room) const {
  if (background_.empty() || !room) return false;
  return items_.empty() || (picture_went_ && items_.front().kind == Kind::kPicture);
}

Packets SendQueue::take_background() {
  Packets packets;
  std::size_t bytes = 0;
  while (!background_.empty() && (packets.empty() || bytes + background_.front().size() <= limits_.background_bytes)) {
    bytes += background_.front().size();
    packets.push_back(std::move(background_.front()));
    background_.pop_front();
  }
  picture_went_ = false;
  return packets;
}

Packets SendQueue::take_messages(Microseconds now, const MakePicture& make, const MakeNoChange& make_answer) {
  Packets packets;
  if (!items_.empty() && items_.front().kind == Kind::kPicture) {
    picture_went_ = true;
    packets.push_back(take_first(now, make, make_answer));
    return packets;
  }
  std::size_t bytes = 0;
  while (!items_.empty() && items_.front().kind != Kind::kPicture &&
         (packets.empty() || bytes + items_.front().packet.size() <= limits_.write_bytes)) {
    packets.push_back(take_first(now, make, make_answer));
    bytes += packets.back().size();
  }
  return packets;
}

Packet SendQueue::take_first(Microseconds now, const MakePicture& make, const MakeNoChange& make_answer) {
  Item item = std::move(items_.front());
  items_.pop_front();
  switch (item.kind) {
    case Kind::kControl:
      control_waiting_bytes_ -= item.packet.size();
      return std::move(item.packet);
    case Kind::kManifest:
    case Kind::kBulk:
      --bulk_waiting_;
      return std::move(item.packet);
    case Kind::kCoarse:
      return std::move(item.packet);
    case Kind::kPicture:
      key_under_way_ = item.frame->key;
      --track(item.frame->layer).waiting;
      track(item.frame->layer).waiting_bytes -= size_of(*item.frame);
      if (item.frame->layer == StreamLayer::kShared) attach_lost_answer(item.answer);
      item.answer.stamps.sent = now;
      return make(item.frame, item.answer);
    case Kind::kNoChange: {
      item.answer.stamps.sent = now;
      return make_answer(NoChange(item.answer, item.error));
    }
  }
  return {};
}

bool SendQueue::ask_for_key(Microseconds now, StreamLayer layer) {
  auto& mine = track(layer);
  // The shared stream begins with a key frame by itself; a private one may never begin.
  if (!mine.key_needed || (layer == StreamLayer::kView && !mine.refused)) return false;
  if (bulk_waiting_ > 0 || mine.waiting > 0) return false;
  if (under_way_since_ && now - *under_way_since_ > limits_.media_age) return false;  // it would only wait behind this
  if (mine.key_asked && now - *mine.key_asked < kKeyPatience) return false;
  mine.key_asked = now;
  return true;
}

bool SendQueue::too_slow(Microseconds now) const {
  return (under_way_since_ && now - *under_way_since_ > limits_.grace) ||
         control_waiting_bytes_ > limits_.control_bytes;
}

void SendQueue::clear() {
  items_.clear();
  background_.clear();
  bulk_waiting_ = control_waiting_bytes_ = 0;
  for (auto& t : tracks_) t.waiting = t.waiting_bytes = 0;
}

}  // namespace darm::session
