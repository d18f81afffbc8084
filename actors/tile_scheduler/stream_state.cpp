#include "actors/tile_scheduler/stream_state.hpp"

#include <algorithm>
#include <utility>

namespace darm::tile_scheduler {

std::size_t slot_count(const StreamFormat& format) {
  const std::size_t side = format.phystex_size / kSlotSize;
  return std::clamp<std::size_t>(side * side, 1, kNoSlot);
}

StreamState::StreamState(const StreamFormat& format, StreamOptions options)
    : options_(options), table_(slot_count(format)), sent_(table_.capacity()) {
  options_.max_writes = std::max<std::size_t>(1, options_.max_writes);
}

void StreamState::view_ready(const ViewAnswer& answer) {
  auto& mine = answers_[answer.session];
  if (answer.sequence >= mine.sequence) mine = answer;
}

std::optional<ViewAnswer> StreamState::forget_session(SessionId session) {
  std::optional<ViewAnswer> open;
  const auto is_its = [&](const ViewAnswer& a) { return a.session == session; };
  if (const auto sent = std::ranges::find_if(answers_in_flight_, is_its); sent != answers_in_flight_.end())
    open = *sent;
  if (const auto it = answers_.find(session); it != answers_.end()) open = it->second;
  answers_.erase(session);
  std::erase_if(answers_in_flight_, is_its);
  return open;
}

bool StreamState::polish_due(Microseconds now) const { return !settled_ && now - sent_at_ >= options_.polish_interval; }

// Whether step() would make a frame that is no key frame.
bool StreamState::has_news(std::span<const TileId> wanted, const ImageLookup& images, Microseconds now) const {
  if (polish_due(now)) return true;
  return std::ranges::any_of(wanted, [&](TileId tile) {
    const auto slot = table_.slot_of(tile);
    if (slot != kNoSlot && !refine_due(now)) return false;
    const auto* image = images(tile);
    return image != nullptr && image->image != nullptr && (slot == kNoSlot || image->version != sent_[slot].version);
  });
}

bool StreamState::answers_in_flight(SessionId session) const {
  return std::ranges::any_of(answers_in_flight_, [&](const ViewAnswer& a) { return a.session == session; });
}

std::vector<ViewAnswer> StreamState::take_answers() {
  std::vector<ViewAnswer> out;
  for (auto& [session, answer] : answers_) out.push_back(answer);
  answers_.clear();
  return out;
}

StreamStep StreamState::step(std::span<const TileId> wanted, const ImageLookup& images, float error, Microseconds now,
                             Microseconds least_interval) {
  StreamStep out;
  if (in_flight()) return out;
  wanted = wanted.first(std::min(wanted.size(), table_.capacity()));
  if (!key_pending_ && now - sent_at_ < least_interval && has_news(wanted, images, now)) {
    out.no_change = take_answers();
    return out;
  }
  encoder::ComposeFrame frame(last_frame_ + 1, key_pending_);
  table_.begin_frame(frame.frame, wanted);
  enter_new(frame, wanted, images);
  if (key_pending_)
    write_all(frame, images);
  else if (!frame.writes.empty() || refine_due(now))
    refine(frame, wanted, images);
  for (const auto& edit : key_pending_ ? table_.whole() : table_.take_edits()) frame.edits.push_back(edit_of(edit));
  if (key_pending_) static_cast<void>(table_.take_edits());

  auto answers = take_answers();
  if (!frame.key && frame.writes.empty() && frame.edits.empty() && !polish_due(now)) {
    out.no_change = std::move(answers);
    return out;
  }
  for (auto& answer : answers) answer.stamps.composed = now;
  frame.answers = answers;
  frame.error = error;
  answers_in_flight_ = std::move(answers);
  last_frame_ = in_flight_ = frame.frame;
  sent_at_ = now;
  key_pending_ = false;
  out.frame = std::move(frame);
  return out;
}

void StreamState::frame_done(FrameNumber number, bool ok, bool settled) {
  if (number != in_flight_ || number == 0) return;  // of an encoder that is gone
  in_flight_ = 0;
  settled_ = settled;
  auto answers = std::exchange(answers_in_flight_, {});
  if (ok) return;
  key_pending_ = true;
  for (const auto& answer : answers) {
    const auto it = answers_.find(answer.session);
    if (it == answers_.end()) answers_.emplace(answer.session, answer);
  }
}

void StreamState::write_slot(encoder::ComposeFrame& frame, SlotIndex slot, const StoredImage& image) {
  encoder::SlotWrite write;
  write.slot = slot;
  write.image = image.image;
  frame.writes.push_back(std::move(write));
  sent_[slot] = {image.version, image.image};
}

void StreamState::enter_new(encoder::ComposeFrame& frame, std::span<const TileId> wanted, const ImageLookup& images) {
  for (const auto tile : wanted) {
    if (frame.writes.size() >= options_.max_writes && !frame.key) return;
    if (table_.slot_of(tile) != kNoSlot) continue;
    const auto* image = images(tile);
    if (image == nullptr || image->image == nullptr) continue;
    const auto slot = table_.insert(tile);
    if (slot == kNoSlot) return;
    write_slot(frame, slot, *image);
  }
}

void StreamState::refine(encoder::ComposeFrame& frame, std::span<const TileId> wanted, const ImageLookup& images) {
  for (const auto tile : wanted) {
    if (frame.writes.size() >= options_.max_writes) return;
    const auto slot = table_.slot_of(tile);
    if (slot == kNoSlot) continue;
    const auto* image = images(tile);
    if (image != nullptr && image->image != nullptr && image->version != sent_[slot].version)
      write_slot(frame, slot, *image);
  }
}

void StreamState::write_all(encoder::ComposeFrame& frame, const ImageLookup& images) {
  frame.writes.clear();
  for (const auto& entry : table_.whole()) {
    const auto* newest = images(entry.tile);
    if (newest != nullptr && newest->image != nullptr) {
      write_slot(frame, entry.slot, *newest);
      continue;
    }
    // Forgotten by the image store since: what was sent last is still right.
    encoder::SlotWrite write;
    write.slot = entry.slot;
    write.image = sent_[entry.slot].image;
    frame.writes.push_back(std::move(write));
  }
}

encoder::PageEdit StreamState::edit_of(const TableEdit& edit) const {
  encoder::PageEdit out;
  out.tile = edit.tile;
  out.slot = edit.slot;
  if (edit.slot != kNoSlot) {
    out.coverage = sent_[edit.slot].image->coverage;
    out.through = sent_[edit.slot].image->through;
  }
  return out;
}

}  // namespace darm::tile_scheduler
