// A session's inbox, as far as other rooms write to it. Plain values only: peers may include this file alone.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "actors/encoder/encoder_messages.hpp"
#include "actors/runtime/overflow.hpp"
#include "actors/types/frame_stamps.hpp"
#include "actors/types/ids.hpp"

namespace darm::wire {
class DatagramBody;
}

namespace darm::session {

/// One encoded picture with everything that must be applied with it. Shared by all sessions of the stream.
struct EncodedFrame {
  StreamId stream{};
  StreamLayer layer = StreamLayer::kShared;
  FrameNumber frame = 0;
  bool key = false;
  std::vector<std::uint8_t> h264;            ///< Annex B, parameter sets in band on key frames; empty if lossless
  std::vector<encoder::SlotWrite> lossless;  ///< only for lossless_rgb streams
  std::vector<encoder::PageEdit> edits;      ///< the whole table when `key`
  float error = 0;                           ///< of all views of the stream; a session's own is in its answer
};

/// A frame for this session. `answer` names the camera it answers (sequence 0: none of this session's).
struct FrameEncoded {
  static constexpr auto kOverflow = runtime::Overflow::kReject;  ///< bounded by the session's own send queue
  std::shared_ptr<const EncodedFrame> frame;
  ViewAnswer answer;
  FrameEncoded(std::shared_ptr<const EncodedFrame> f, const ViewAnswer& a) : frame(std::move(f)), answer(a) {}
};

/// The camera was looked at and nothing perceptible changed.
struct NoChange {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;
  ViewAnswer answer;
  float error = 0;
  NoChange(const ViewAnswer& a, float e) : answer(a), error(e) {}
};

/// The whole coarse level, newly encoded as an H.264 key frame. Replaces what the client had.
struct CoarseTexture {
  std::uint32_t version = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> h264;
};

struct CoarseUpdated {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;
  std::shared_ptr<const CoarseTexture> coarse;
  explicit CoarseUpdated(std::shared_ptr<const CoarseTexture> c) : coarse(std::move(c)) {}
};

/// The daemon stops, or the stream failed for good: say goodbye with this reason and close.
struct CloseSession {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;
  std::uint32_t code = 0;  ///< a darm.proto Goodbye.Reason
  CloseSession() = default;
  explicit CloseSession(std::uint32_t c) : code(c) {}
};

// ---- from the session's own socket and timer; other rooms do not send these ----------------------------------------

/// Bytes of the TCP stream. At most one waits: the next piece is read when this one is handled.
struct BytesReceived {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;  ///< one at a time: never full, never replaced
  std::vector<std::uint8_t> bytes;
  explicit BytesReceived(std::vector<std::uint8_t> b) : bytes(std::move(b)) {}
};

/// The packet under way is with the kernel.
struct BytesSent {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;  ///< one at a time: never full, never replaced
  std::size_t count = 0;
  explicit BytesSent(std::size_t n) : count(n) {}
};

/// The connection is gone: end of stream or an error.
struct SocketClosed {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;
  std::string why;
  explicit SocketClosed(std::string reason) : why(std::move(reason)) {}
};

/// An authenticated datagram of this session.
struct DatagramReceived {
  static constexpr auto kOverflow = runtime::Overflow::kDropOldest;
  std::shared_ptr<const wire::DatagramBody> body;
  explicit DatagramReceived(std::shared_ptr<const wire::DatagramBody> b) : body(std::move(b)) {}
};

/// Time-outs are looked at.
struct Tick {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;
};

using Inbox = std::variant<FrameEncoded, NoChange, CoarseUpdated, CloseSession, BytesReceived, BytesSent, SocketClosed,
                           DatagramReceived, Tick>;

}  // namespace darm::session
