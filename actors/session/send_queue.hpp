// What a session still has to send, in order; decides which pictures are dropped when the client cannot keep up.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <utility>

#include "actors/session/bytes.hpp"
#include "actors/session/session_messages.hpp"

namespace darm::session {

struct SendLimits {
  std::size_t media_bytes = 4u << 20;  ///< pictures waiting behind another picture
  /// Time behind others at which a waiting picture is too old to be of use. What a key frame takes does not count: on a
  /// slow line that is longer, and whoever drops what follows it needs the next one.
  Microseconds media_age = 500'000;
  std::size_t control_bytes = 16u << 20;     ///< control messages waiting
  Microseconds grace = 15'000'000;           ///< a write that takes longer than this: the client does not read
  std::size_t write_bytes = 128u << 10;      ///< messages up to so many bytes together are one write
  std::size_t background_bytes = 64u << 10;  ///< the same for the background, which others wait for
};

/// Why a picture was not sent.
enum class Drop : std::uint8_t {
  kOld,        ///< waited too long
  kFull,       ///< too many bytes waited
  kReplaced,   ///< a key frame came that stands for it
  kLoading,    ///< the scene still went out
  kKeyNeeded,  ///< it builds on one that was not sent
  kElsewhere,  ///< of another stream, whose key frame was still to come
  kMemory,     ///< all sessions together hold as much as they may
};
inline constexpr std::array kDropNames{"old", "full", "replaced", "loading", "key_needed", "elsewhere", "memory"};
using DropCounts = std::array<std::size_t, kDropNames.size()>;

/// First in, first out, but: control messages and coarse textures overtake bulk, and the background goes when nothing
/// else waits, or after each picture, so that neither keeps the other out. Messages go out several at a time, because
/// each write costs a turn of the session, which on a busy machine is tens of milliseconds; bounded in bytes, because
/// what comes meanwhile waits for the write. Control messages, bulk and background are never dropped. Pictures are
/// dropped whole, and all that wait together with the new one, because each builds on the one before; then only a key
/// frame is taken. The two layers are streams of their own in this, with limits of their own. While bulk waits no
/// picture is taken. Of a stream other than the pictures before no picture is taken until its key frame comes: the
/// client keeps what it shows. The answer of a dropped picture travels with the next one that is sent. No clock inside:
/// `now` must not decrease.
class SendQueue {
 public:
  explicit SendQueue(const SendLimits& limits) : limits_(limits) {}

  void push_control(Packet packet);
  /// What the first picture needs.
  void push_bulk(Packet packet);
  /// What is of use later.
  void push_background(Packet packet) { background_.push_back(std::move(packet)); }
  /// Bulk that all later bulk and coarse textures need.
  void push_manifest(Packet packet);
  /// Replaces a coarse texture that still waits. Overtakes bulk, so that what comes of it can be drawn lit.
  void push_coarse(Packet packet);
  /// False: dropped (and with it whatever pictures waited). `room`: there is memory for more than one to wait.
  bool push_picture(const std::shared_ptr<const EncodedFrame>& frame, const ViewAnswer& answer, Microseconds now,
                    bool room = true);
  /// An answer without a picture. Kept back for the next picture if the client is waiting for a key frame.
  void push_no_change(const NoChange& event);

  /// The next write, if none is under way: a picture by itself, or messages of one kind of the limits above. `make`
  /// turns a picture into bytes when its turn comes.
  using MakePicture = std::function<Packet(const std::shared_ptr<const EncodedFrame>&, const ViewAnswer&)>;
  using MakeNoChange = std::function<Packet(const NoChange&)>;
  /// `room`: the background may have its turn.
  [[nodiscard]] Packets take(Microseconds now, const MakePicture& make, const MakeNoChange& make_answer,
                             bool room = true);
  /// The write under way is out.
  void sent(Microseconds now);

  /// True when a key frame should be asked for: one is needed, there is room for it, and none was asked for lately.
  [[nodiscard]] bool ask_for_key(Microseconds now, StreamLayer layer = StreamLayer::kShared);
  /// Something is lost on the client's side: pictures are of no use until the next key frame.
  void require_key(StreamLayer layer = StreamLayer::kShared) { track(layer).key_needed = track(layer).refused = true; }
  [[nodiscard]] bool too_slow(Microseconds now) const;
  /// Drops everything that waits; what is under way stays so.
  void clear();
  [[nodiscard]] bool idle() const { return items_.empty() && background_.empty() && !under_way_since_; }
  /// What the first picture needs still waits.
  [[nodiscard]] bool loading() const { return bulk_waiting_ > 0; }
  /// Of pictures that wait.
  [[nodiscard]] std::size_t media_bytes() const { return tracks_[0].waiting_bytes + tracks_[1].waiting_bytes; }
  /// Of control messages that wait.
  [[nodiscard]] std::size_t control_bytes() const { return control_waiting_bytes_; }
  /// Of all that waits, but for what was made for everybody (the scene).
  [[nodiscard]] std::size_t bytes() const { return media_bytes() + control_waiting_bytes_; }
  /// Since it was made, by reason.
  [[nodiscard]] const DropCounts& drops() const { return drops_; }
  [[nodiscard]] bool any_dropped() const {
    return std::ranges::any_of(drops_, [](std::size_t n) { return n > 0; });
  }
  /// Pictures that were dropped because the client does not keep up.
  [[nodiscard]] std::size_t overdue() const { return dropped(Drop::kOld) + dropped(Drop::kFull); }

 private:
  enum class Kind : std::uint8_t { kControl, kManifest, kBulk, kCoarse, kPicture, kNoChange };
  struct Item {
    Kind kind;
    Packet packet;  // control, manifest, bulk, coarse
    std::shared_ptr<const EncodedFrame> frame;
    ViewAnswer answer;
    float error = 0;
    Microseconds since = 0;
  };
  static std::size_t size_of(const EncodedFrame& frame) {
    return frame.h264.size() + frame.lossless.size() * sizeof(TileImage::rgb) + frame.edits.size() * 8;
  }
  // Pictures of one layer.
  struct Track {
    std::size_t waiting_bytes = 0;
    std::size_t waiting = 0;
    bool key_needed = true;
    bool refused = false;  // a picture was turned away: a key frame is of use
    std::optional<Microseconds> key_asked;
    StreamId stream{};       // of the picture that was taken last,
    FrameNumber newest = 0;  // and its number
  };
  static void await_key(Track& mine, Microseconds now);
  [[nodiscard]] Track& track(StreamLayer layer) { return tracks_[layer == StreamLayer::kView ? 1 : 0]; }
  void drop_pictures(StreamLayer layer, Drop why);
  bool turn_away(const ViewAnswer& answer, Drop why);
  [[nodiscard]] Microseconds waited(const Item& item, Microseconds now) const;
  void note(Drop why) { ++drops_[static_cast<std::size_t>(why)]; }
  [[nodiscard]] std::size_t dropped(Drop why) const { return drops_[static_cast<std::size_t>(why)]; }
  void keep_answer(const ViewAnswer& answer);
  void attach_lost_answer(ViewAnswer& answer);
  void insert_before_bulk(Item item);
  [[nodiscard]] bool background_next(bool room) const;
  [[nodiscard]] Packets take_background();
  [[nodiscard]] Packets take_messages(Microseconds now, const MakePicture& make, const MakeNoChange& make_answer);
  [[nodiscard]] Packet take_first(Microseconds now, const MakePicture& make, const MakeNoChange& make_answer);

  SendLimits limits_;
  std::deque<Item> items_;
  std::deque<Packet> background_;
  bool picture_went_ = false;  // since the background had its turn
  std::size_t bulk_waiting_ = 0;
  std::size_t control_waiting_bytes_ = 0;
  DropCounts drops_{};
  std::optional<Microseconds> under_way_since_;
  bool key_under_way_ = false;
  Microseconds key_sent_at_ = 0;
  std::array<Track, 2> tracks_;
  ViewAnswer lost_answer_;  // sequence 0: none
};

}  // namespace darm::session
