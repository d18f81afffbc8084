#include "client/load/stream_check.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/core/page_table.hpp"
#include "client/load/nal_units.hpp"
#include "client/load/split_mix.hpp"

namespace darm::client::load {
namespace {

constexpr std::uint32_t kNobody = 0xffffffffu;
constexpr std::uint64_t kMostDropped = 1u << 20;

// The sum over all residents tells tables apart.
std::uint64_t mark(std::uint32_t entry, std::uint16_t slot) {
  return split_mix((std::uint64_t{entry} << 16 | slot) + 0x9e3779b97f4a7c15u);
}

}  // namespace

StreamCheck::StreamCheck(std::shared_ptr<const SceneModel> scene, const StreamShape& shape)
    : scene_(std::move(scene)),
      shape_(shape),
      slot_of_(scene_->tile_count(), kAbsent),
      holder_(shape.slot_count(), kNobody) {}

FrameNews StreamCheck::take(const wire::StreamFrame& frame, FaultCounts& faults) {
  FrameNews news;
  if (!(std::isfinite(frame.error()) && frame.error() >= 0)) faults.add(Fault::kError);
  check_picture(frame, faults);
  if (!in_order(frame, faults, news)) return news;
  if (frame.key()) clear();
  apply_edits(frame, faults);
  stream_ = frame.stream();
  last_ = frame.frame();
  begun_ = true;
  lost_ = false;
  news.applied = true;
  return news;
}

bool StreamCheck::in_order(const wire::StreamFrame& frame, FaultCounts& faults, FrameNews& news) {
  const bool same_stream = !begun_ || frame.stream() == stream_;
  if (frame.key()) {
    // Numbers of another stream have nothing to do with those before.
    if (begun_ && same_stream && frame.frame() > last_ + 1) news.dropped = frame.frame() - last_ - 1;
    if (news.dropped > kMostDropped) news.dropped = 1;  // no link loses so many: the numbers began anew
    return true;
  }
  if (begun_ && !lost_ && same_stream && frame.frame() == last_ + 1) return true;
  ++frames_lost_;
  if (!lost_) faults.add(same_stream ? Fault::kFrameOrder : Fault::kStreamWithoutKey);
  lost_ = true;
  return false;
}

void StreamCheck::check_picture(const wire::StreamFrame& frame, FaultCounts& faults) const {
  if (shape_.lossless) return;
  if (frame.h264().empty()) {
    faults.add(Fault::kNoPicture);
  } else if (picture_start(frame.h264()) != (frame.key() ? PictureStart::kKey : PictureStart::kDelta)) {
    faults.add(Fault::kWrongPicture);
  }
  if (frame.pixels_size() > 0) faults.add(Fault::kWrongPicture);
}

// In order, as they were made: within a frame a slot may pass from hand to hand; what counts is what it ends with.
void StreamCheck::apply_edits(const wire::StreamFrame& frame, FaultCounts& faults) {
  displaced_.clear();
  for (const auto& edit : frame.page_edits()) {
    std::uint32_t entry = 0;
    if (!scene_->page_entry(edit.tile(), entry)) {
      faults.add(Fault::kTile);
    } else if (edit.slot() == kAbsent) {
      set(entry, kAbsent);
    } else if (edit.slot() >= shape_.slot_count()) {
      faults.add(Fault::kSlot);
    } else {
      place(entry, static_cast<std::uint16_t>(edit.slot()), faults);
    }
  }
  for (const auto entry : displaced_) {
    if (slot_of_[entry] == kAbsent || holder_[slot_of_[entry]] == entry) continue;
    faults.add(Fault::kSlotTwice);
    // The newcomer has it from here on.
    table_hash_ -= mark(entry, slot_of_[entry]);
    slot_of_[entry] = kAbsent;
    --residents_;
  }
}

void StreamCheck::place(std::uint32_t entry, std::uint16_t slot, FaultCounts& faults) {
  if (slot_of_[entry] == slot && holder_[slot] == entry) return;
  if (slot_of_[entry] != kAbsent && slot_of_[entry] != slot) faults.add(Fault::kTileTwice);
  if (holder_[slot] != kNobody && holder_[slot] != entry) displaced_.push_back(holder_[slot]);
  set(entry, slot);
}

void StreamCheck::set(std::uint32_t entry, std::uint16_t slot) {
  auto& place = slot_of_[entry];
  if (place != kAbsent) {
    if (holder_[place] == entry) holder_[place] = kNobody;
    table_hash_ -= mark(entry, place);
    --residents_;
  }
  place = slot;
  if (slot == kAbsent) return;
  holder_[slot] = entry;
  table_hash_ += mark(entry, slot);
  ++residents_;
}

void StreamCheck::clear() {
  std::fill(slot_of_.begin(), slot_of_.end(), kAbsent);
  std::fill(holder_.begin(), holder_.end(), kNobody);
  table_hash_ = 0;
  residents_ = 0;
}

}  // namespace darm::client::load
