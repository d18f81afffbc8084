// The tile scheduler's inbox. Plain values only: peers may include this file and nothing else of the room.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "actors/runtime/overflow.hpp"
#include "actors/types/camera.hpp"
#include "actors/types/frame_stamps.hpp"
#include "actors/types/ids.hpp"
#include "actors/types/tile_image.hpp"

namespace darm::tile_scheduler {

/// How a session receives its PhysTex. `lossless_rgb`: no codec, tiles as they are (evaluation; config must allow it).
struct StreamFormat {
  std::uint32_t phystex_size = 2048;  ///< pixels, square: 1024, 2048 or 4096 (lossless: up to 16384)
  bool chroma_444 = false;
  bool lossless_rgb = false;
  std::uint32_t view_phystex = 0;  ///< of the private layer: 0 (none), 512 or 1024 (lossless: up to 2048)
  StreamLayer layer = StreamLayer::kShared;
  /// 0: for clients that keep up. Others, whose links are slow, share with those of their own lane only (MemberLink).
  std::uint8_t lane = 0;

  bool operator==(const StreamFormat&) const = default;
  /// The format of light for everybody: sessions of one such format may share a stream.
  [[nodiscard]] StreamFormat shared_format() const {
    StreamFormat f = *this;
    f.view_phystex = 0;
    f.layer = StreamLayer::kShared;
    return f;
  }
  /// The private layer's own stream. `view_phystex` > 0.
  [[nodiscard]] StreamFormat view_format() const {
    StreamFormat f = *this;
    f.phystex_size = view_phystex;
    f.layer = StreamLayer::kView;
    return f;
  }
};

/// A client finished its handshake and is ready for frames.
struct SessionOpened {
  static constexpr auto kOverflow = runtime::Overflow::kReject;
  SessionId session{};
  StreamFormat format;
  float target_error = 0;  ///< RMS display error under which a tile costs no more time for it; 0: never
  SessionOpened(SessionId id, StreamFormat f, float target) : session(id), format(f), target_error(target) {}
};

struct SessionClosed {
  static constexpr auto kOverflow = runtime::Overflow::kReject;
  SessionId session{};
  explicit SessionClosed(SessionId id) : session(id) {}
};

/// Newest camera of a session. Validated by the session before it is sent.
struct ViewChanged {
  static constexpr auto kOverflow = runtime::Overflow::kLatestByKey;
  SessionId session{};
  CameraSequence sequence = 0;
  Camera camera;
  Viewport viewport;
  FrameStamps stamps;
  ViewChanged(SessionId id, CameraSequence seq, const Camera& c, const Viewport& v, const FrameStamps& s)
      : session(id), sequence(seq), camera(c), viewport(v), stamps(s) {}
  [[nodiscard]] std::uint64_t key() const { return static_cast<std::uint64_t>(session); }
};
/// Both would see the very same picture.
[[nodiscard]] inline bool same_view(const ViewChanged& a, const ViewChanged& b) {
  return a.camera.position == b.camera.position && a.camera.orientation == b.camera.orientation &&
         a.camera.fovy == b.camera.fovy && a.viewport.width == b.viewport.width &&
         a.viewport.height == b.viewport.height;
}

/// The session lost a frame or joined late: its next frame must be a key frame with the whole page table.
struct KeyFrameWanted {
  static constexpr auto kOverflow = runtime::Overflow::kLatestByKey;
  SessionId session{};
  StreamLayer layer = StreamLayer::kShared;
  bool behind = false;  ///< pictures were dropped because the client does not keep up
  explicit KeyFrameWanted(SessionId id, StreamLayer of = StreamLayer::kShared, bool is_behind = false)
      : session(id), layer(of), behind(is_behind) {}
  [[nodiscard]] std::uint64_t key() const {
    return static_cast<std::uint64_t>(session) * 2 + (layer == StreamLayer::kView ? 1 : 0);
  }
};

enum class LinkState : std::uint8_t {
  kFree,     ///< there is room for a picture
  kFull,     ///< pictures are on their way, and another would only wait behind them
  kLoading,  ///< the scene still goes out: no picture is taken
};

/// What the link of a session carries has changed. Not told of links that are always free.
struct LinkChanged {
  static constexpr auto kOverflow = runtime::Overflow::kLatestByKey;
  SessionId session{};
  LinkState state = LinkState::kFree;
  double bytes_per_second = 0;  ///< that it carries; 0: not known
  LinkChanged(SessionId id, LinkState s, double rate) : session(id), state(s), bytes_per_second(rate) {}
  [[nodiscard]] std::uint64_t key() const { return static_cast<std::uint64_t>(session); }
};

/// A tile has a new picture. `error` is its estimated RMS display error (0..1), `samples` the mean samples per seen
/// texel.
struct ShadedTile {
  TileId tile;
  std::uint32_t version = 0;
  float error = 0;
  float samples = 0;
  std::shared_ptr<const TileImage> image;
};

struct TilesShaded {
  static constexpr auto kOverflow = runtime::Overflow::kReject;
  std::vector<ShadedTile> tiles;
  explicit TilesShaded(std::vector<ShadedTile> t) : tiles(std::move(t)) {}
};

/// Private tiles of one session have new pictures, for an eye it had a moment ago.
struct ViewTilesShaded {
  static constexpr auto kOverflow = runtime::Overflow::kReject;
  SessionId session{};
  std::vector<ShadedTile> tiles;
  ViewTilesShaded(SessionId id, std::vector<ShadedTile> t) : session(id), tiles(std::move(t)) {}
};

/// CoarseTex as clients draw it, luma, row-major.
struct CoarseLuma {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> luma;
  std::vector<float> errors{};  ///< of each of its tiles, row-major: RMS display error expected of its light, 0..1
};

/// The coarse level has a new picture.
struct CoarsePictured {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;
  std::shared_ptr<const CoarseLuma> picture;
  explicit CoarsePictured(std::shared_ptr<const CoarseLuma> p) : picture(std::move(p)) {}
};

/// The encoder has finished a frame of a stream: the scheduler may send the next ComposeFrame.
struct FrameDone {
  static constexpr auto kOverflow = runtime::Overflow::kReject;
  StreamId stream{};
  FrameNumber frame = 0;
  bool ok = true;
  bool settled = true;    ///< false: the same picture coded again would be finer
  Microseconds busy = 0;  ///< processor time of composing and encoding it; 0: unknown
  bool key = false;
  std::size_t bytes = 0;  ///< as sent to each session
  bool limited = false;   ///< it would have been larger without its ComposeFrame::most_bytes
  FrameDone(StreamId s, FrameNumber f, bool success, bool is_settled = true, Microseconds took = 0)
      : stream(s), frame(f), ok(success), settled(is_settled), busy(took) {}
};

/// Visibility of one session's view is traced (sent by the scheduler's own pool job to itself).
struct ViewTraced {
  static constexpr auto kOverflow = runtime::Overflow::kReject;
  std::uint64_t job = 0;
  explicit ViewTraced(std::uint64_t number) : job(number) {}
};

/// The update clock: at each tick the scheduler traces, allocates and sends frames.
struct Tick {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;
};

using Inbox = std::variant<SessionOpened, SessionClosed, ViewChanged, KeyFrameWanted, LinkChanged, TilesShaded,
                           ViewTilesShaded, CoarsePictured, FrameDone, ViewTraced, Tick>;

}  // namespace darm::tile_scheduler
