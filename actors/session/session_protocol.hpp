// What a session says and when, without socket, clock or thread: bytes, events and the time go in, actions come out.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "actors/encoder/encoder_messages.hpp"
#include "actors/session/frame_message.hpp"
#include "actors/session/geometry_stream.hpp"
#include "actors/session/link_pace.hpp"
#include "actors/session/send_queue.hpp"
#include "actors/session/session_memory.hpp"
#include "actors/session/session_messages.hpp"
#include "actors/tile_scheduler/tile_scheduler_messages.hpp"
#include "proto/darm.pb.h"
#include "proto/framing.hpp"

namespace darm::session {

/// What the daemon offers its clients.
struct SessionPolicy {
  std::uint32_t phystex_size = 2048;  ///< most a client gets: 1024, 2048 or 4096
  bool allow_chroma_444 = true;
  bool allow_lossless = false;     ///< tiles without codec, PhysTex up to 8192 (evaluation)
  std::uint32_t view_phystex = 0;  ///< most of a private layer: 0 (the scene calls for none), 512 or 1024
  float updates_per_second = 10.0f;
  float target_error = 0.002f;        ///< of a client that does not ask for its own, RMS display error, > 0
  float least_target_error = 0.002f;  ///< that a client may ask for: more exact than this is not computed for anybody
  Camera start;                       ///< where a client without a pose begins
  Viewport start_viewport;
  std::string server = "darmd";
  Microseconds handshake_timeout = 5'000'000;
  Microseconds idle_timeout = 30'000'000;
  Microseconds goodbye_timeout = 2'000'000;  ///< for the last message to leave
  unsigned max_protocol_errors = 16;
  SendLimits send;
  /// What sessions hold together. Without room a client gets no private layer, and pictures do not wait for it.
  std::shared_ptr<SessionMemory> memory = std::make_shared<SessionMemory>();
};

/// Something worth a number: `what` is from a small fixed set, for metrics.
struct Noted {
  std::string_view what;
};

/// For metrics as well.
struct PicturesDropped {
  std::string_view why;
  std::size_t count = 0;
};

/// What others are told. In order.
using Action = std::variant<tile_scheduler::SessionOpened, tile_scheduler::ViewChanged, tile_scheduler::KeyFrameWanted,
                            tile_scheduler::LinkChanged, encoder::CoarseWanted, Noted, PicturesDropped>;
using Actions = std::vector<Action>;

/// One client from its first byte to its last: Hello, Welcome, manifest, geometry in view, CoarseTex, pictures and
/// the rest of the geometry.
/// `now` is in microseconds and must not decrease.
class SessionProtocol {
 public:
  /// `key`: 32 random bytes. `udp_port`: 0 if there is no UDP. `scene` and `bodies` are shared by all sessions.
  SessionProtocol(SessionId id, const SessionPolicy& policy, std::string key, std::uint16_t udp_port,
                  std::shared_ptr<const GeometryStream> scene, std::shared_ptr<FrameBodies> bodies, Microseconds now);

  [[nodiscard]] Actions on_bytes(std::span<const std::uint8_t> bytes, Microseconds now);
  [[nodiscard]] Actions on_datagram(const wire::DatagramBody& body, Microseconds now);  ///< authenticated before
  [[nodiscard]] Actions on_frame(const FrameEncoded& event, Microseconds now);
  [[nodiscard]] Actions on_sent(Microseconds now);
  [[nodiscard]] Actions on_tick(Microseconds now);
  void on_no_change(const NoChange& event);
  void on_coarse(const CoarseUpdated& event);
  /// Says what it holds now to the policy's memory.
  void note_memory();

  /// Says goodbye: what waits is dropped, the goodbye goes out next. The first reason stands.
  void close(wire::Goodbye::Reason reason, std::string text, Microseconds now);

  /// The next messages for the socket, to be written at once; none while some are under way. on_sent() says they are
  /// out.
  [[nodiscard]] Packets next_packets(Microseconds now);
  /// The connection can be closed.
  [[nodiscard]] bool finished(Microseconds now) const;
  /// The reason and sentence of the end, for the log; empty while it goes on.
  [[nodiscard]] const std::string& end() const { return end_; }
  /// A word for that, for metrics: "left", or the goodbye's reason as TOO_SLOW; empty while it goes on.
  [[nodiscard]] const std::string& end_reason() const { return end_reason_; }
  [[nodiscard]] bool open() const { return state_ == State::kOpen; }
  [[nodiscard]] const std::string& client_name() const { return client_name_; }

 private:
  enum class State : std::uint8_t { kAwaitHello, kOpen, kClosing, kClosed };
  void on_envelope(const wire::Envelope& envelope, Microseconds now, Actions& actions);
  void on_hello(const wire::Hello& hello, Microseconds now, Actions& actions);
  void on_camera(const wire::CameraUpdate& update, Microseconds now, Actions& actions);
  void on_feedback(const wire::Feedback& feedback, Actions& actions);
  void on_ping(const wire::Ping& ping, Microseconds now);
  void fault(std::string_view what, Microseconds now, Actions& actions);
  std::optional<tile_scheduler::StreamFormat> negotiate(const wire::Hello& hello) const;
  [[nodiscard]] float target_error(const wire::Hello& hello) const;
  void send(const wire::Envelope& envelope);
  void send_welcome(const tile_scheduler::StreamFormat& format, float target_error, bool scene_known,
                    std::uint32_t chunks_in_view);
  void send_scene(const GeometryStream::Order& order);
  void ask_for_keys(Microseconds now, Actions& actions);
  void tell_link(Microseconds now, Actions& actions);
  void tell_drops(Actions& actions);

  SessionId id_;
  SessionPolicy policy_;
  std::string key_;
  std::uint16_t udp_port_;
  std::shared_ptr<const GeometryStream> scene_;
  std::shared_ptr<FrameBodies> bodies_;
  proto::FrameReader reader_;
  SendQueue queue_;
  SessionMemory::Share memory_;
  std::size_t layer_bytes_ = 0;
  LinkPace pace_;
  std::size_t overdue_told_ = 0;  // of those that it dropped because it does not keep up, the scheduler knows so many
  DropCounts drops_told_{};
  tile_scheduler::LinkState link_told_ = tile_scheduler::LinkState::kFree;
  double rate_told_ = 0;
  State state_ = State::kAwaitHello;
  Microseconds started_;
  Microseconds heard_;
  Microseconds closing_since_ = 0;
  CameraSequence newest_camera_ = 0;
  unsigned faults_ = 0;
  std::uint32_t coarse_version_ = 0;
  std::string end_;
  std::string end_reason_;
  std::string client_name_;
};

}  // namespace darm::session
