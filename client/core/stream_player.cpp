#include "client/core/stream_player.hpp"

#include <fmt/format.h>

#include <span>
#include <utility>

#include "client/core/inflate.hpp"

namespace darm::client {
namespace {

constexpr std::uint32_t kSlotTexels = kSlotSize * kSlotSize;
constexpr std::uint32_t kNoTile = 0xffffffffu;

std::span<const std::uint8_t> bytes_of(const std::string& s) {
  return {reinterpret_cast<const std::uint8_t*>(s.data()), s.size()};
}

// Exactly `bytes` of one slot, or nothing.
std::optional<std::string> inflate_slot(const std::string& packed, std::size_t bytes) {
  auto out = inflate(packed, bytes);
  if (out && out->size() != bytes) return std::nullopt;
  return out;
}

}  // namespace

StreamPlayer::StreamPlayer(VideoDecoder decoder, VideoDecoder still_decoder, const SceneModel& scene,
                           const StreamShape& shape)
    : decoder_(std::move(decoder)),
      still_decoder_(std::move(still_decoder)),
      shape_(shape),
      pages_(scene.tile_count()),
      slot_tile_(shape.slot_count(), kNoTile),
      slot_masked_(shape.slot_count(), false),
      slot_clear_(shape.slot_count(), false) {}

Result<StreamPlayer> StreamPlayer::create(const SceneModel& scene, const StreamShape& shape) {
  const std::uint32_t most = shape.lossless ? 16384 : 4096;
  if (shape.phystex_size < kSlotSize || shape.phystex_size > most || shape.phystex_size % kSlotSize != 0) {
    return fail(fmt::format("welcome: PhysTex of {} pixels refused", shape.phystex_size));
  }
  auto decoder = VideoDecoder::create(shape.phystex_size, shape.phystex_size);
  if (!decoder) return std::unexpected(decoder.error());
  const auto& coarse = scene.levels().back();
  auto still = VideoDecoder::create(coarse.width, coarse.height);
  if (!still) return std::unexpected(still.error());
  return StreamPlayer(std::move(*decoder), std::move(*still), scene, shape);
}

Result<std::vector<StreamPlayer::Edit>> StreamPlayer::read_edits(const wire::StreamFrame& frame,
                                                                 const SceneModel& scene) const {
  const auto count = static_cast<std::uint64_t>(frame.page_edits_size());
  if (count > proto::kMaxPageEditsPerSlot * shape_.slot_count())
    return fail(fmt::format("frame {}: {} page edits", frame.frame(), count));
  std::vector<Edit> edits;
  edits.reserve(count);
  for (const auto& info : frame.page_edits()) {
    Edit edit{};
    if (!scene.page_entry(info.tile(), edit.entry))
      return fail(fmt::format("frame {}: no such tile {:#x}", frame.frame(), info.tile()));
    if (info.slot() != kAbsent && info.slot() >= shape_.slot_count())
      return fail(fmt::format("frame {}: no such slot {}", frame.frame(), info.slot()));
    edit.slot = static_cast<std::uint16_t>(info.slot());
    if (!info.coverage().empty()) {
      auto coverage = inflate_slot(info.coverage(), kSlotTexels);
      if (!coverage)
        return fail(fmt::format("frame {}: coverage of tile {:#x} is not 32x32", frame.frame(), info.tile()));
      edit.coverage = std::move(*coverage);
    }
    if (!info.through().empty()) {
      auto through = inflate_slot(info.through(), kSlotTexels * 3);
      if (!through)
        return fail(fmt::format("frame {}: through of tile {:#x} is not 32x32x3", frame.frame(), info.tile()));
      edit.through = std::move(*through);
    }
    edits.push_back(std::move(edit));
  }
  return edits;
}

Result<void> StreamPlayer::check_pixels(const wire::StreamFrame& frame) const {
  if (frame.pixels_size() > 0 && !shape_.lossless)
    return fail(fmt::format("frame {}: bare pixels on a coded stream", frame.frame()));
  for (const auto& p : frame.pixels()) {
    if (p.slot() >= shape_.slot_count() || p.rgb().size() != kSlotTexels * 3) {
      return fail(fmt::format("frame {}: slot pixels out of range", frame.frame()));
    }
  }
  return {};
}

void StreamPlayer::lose_track() {
  ++frames_lost_;
  if (!key_wanted_) decoder_.reset();
  key_wanted_ = true;
}

Result<FrameFate> StreamPlayer::apply(const wire::StreamFrame& frame, const SceneModel& scene) {
  if (!frame.key() && (key_wanted_ || frame.stream() != stream_ || frame.frame() != last_frame_ + 1)) {
    lose_track();
    return FrameFate::kSkipped;
  }
  auto edits = read_edits(frame, scene);
  if (!edits) return std::unexpected(edits.error());
  if (auto ok = check_pixels(frame); !ok) return std::unexpected(ok.error());
  if (!shape_.lossless && (frame.key() || !frame.h264().empty())) {
    if (frame.key()) decoder_.reset();
    const auto next = pool_.take();
    const auto decoded = decoder_.decode(bytes_of(frame.h264()), *next);
    if (!decoded) {
      key_wanted_ = false;  // so that lose_track() resets the decoder
      lose_track();
      return FrameFate::kSkipped;
    }
    if (next->width != shape_.phystex_size || next->height != shape_.phystex_size) {
      return fail(
          fmt::format("frame {}: picture is {}x{}, not the size agreed", frame.frame(), next->width, next->height));
    }
    picture_ = next;
    news_.picture = next;
  }
  commit(frame, std::move(*edits));
  return FrameFate::kApplied;
}

void StreamPlayer::commit(const wire::StreamFrame& frame, std::vector<Edit> edits) {
  if (frame.key()) pages_.clear();
  if (!begun_) news_.fresh = true;
  begun_ = true;
  for (auto& edit : edits) {
    pages_.set(edit.entry, edit.slot);
    if (edit.slot == kAbsent) continue;
    const bool same_tile = slot_tile_[edit.slot] == edit.entry;
    slot_tile_[edit.slot] = edit.entry;
    if (!edit.through.empty()) {
      news_.through[edit.slot] = std::move(edit.through);
      slot_clear_[edit.slot] = true;
    } else if (!same_tile && slot_clear_[edit.slot]) {
      news_.through[edit.slot] = std::string(kSlotTexels * 3, '\0');
      slot_clear_[edit.slot] = false;
    }
    if (!edit.coverage.empty()) {
      news_.coverage[edit.slot] = std::move(edit.coverage);
      slot_masked_[edit.slot] = true;
    } else if (!same_tile && slot_masked_[edit.slot]) {  // coverage is sent once: a tile that stays keeps its own
      news_.coverage[edit.slot] = std::string(kSlotTexels, '\xff');
      slot_masked_[edit.slot] = false;
    }
  }
  for (const auto& p : frame.pixels()) news_.pixels[static_cast<std::uint16_t>(p.slot())] = p.rgb();
  last_frame_ = frame.frame();
  stream_ = frame.stream();
  key_wanted_ = false;
}

Result<void> StreamPlayer::apply(const wire::CoarseTexture& coarse, const SceneModel& scene) {
  const auto& level = scene.levels().back();
  if (coarse.width() != level.width || coarse.height() != level.height)
    return fail("coarse texture: size differs from the manifest");
  auto picture = std::make_shared<Picture>();
  still_decoder_.reset();
  if (auto ok = still_decoder_.decode(bytes_of(coarse.h264()), *picture); !ok)
    return std::unexpected(Error("coarse texture: " + ok.error().message));
  if (picture->width != level.width || picture->height != level.height)
    return fail("coarse texture: picture has another size");
  news_.coarse = std::move(picture);
  has_coarse_ = true;
  return {};
}

StreamNews StreamPlayer::take_news() {
  if (begun_) {
    for (const auto& rows : pages_.take_dirty_rows()) {
      for (std::uint32_t row = rows.first; row < rows.first + rows.count; ++row) {
        const std::uint16_t* slots = pages_.data() + std::size_t{row} * kTableWidth;
        news_.pages[row].assign(slots, slots + kTableWidth);
      }
    }
  }
  return std::exchange(news_, {});
}

}  // namespace darm::client
