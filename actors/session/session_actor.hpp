// One client: its protocol, its connection, and what it tells the other rooms.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "actors/encoder/encoder_messages.hpp"
#include "actors/runtime/actor.hpp"
#include "actors/runtime/metrics.hpp"
#include "actors/runtime/registry.hpp"
#include "actors/session/address_places.hpp"
#include "actors/session/connection.hpp"
#include "actors/session/datagram_directory.hpp"
#include "actors/session/session_protocol.hpp"

namespace darm::session {

inline constexpr unsigned kSessionsPerAddress = 64;

using SessionRegistry = runtime::Registry<SessionId, Inbox>;

/// What all sessions share. Made by the composition root.
struct SessionSurroundings {
  SessionPolicy policy;
  std::shared_ptr<const GeometryStream> scene;
  runtime::Ref<tile_scheduler::Inbox> scheduler;
  runtime::Ref<encoder::CoarseInbox> coarse;
  std::shared_ptr<SessionRegistry> sessions;
  std::shared_ptr<FrameBodies> bodies = std::make_shared<FrameBodies>();
  std::shared_ptr<DatagramDirectory> datagrams = std::make_shared<DatagramDirectory>();
  std::shared_ptr<AddressPlaces> addresses = std::make_shared<AddressPlaces>(kSessionsPerAddress);
  std::shared_ptr<std::atomic<unsigned>> live = std::make_shared<std::atomic<unsigned>>(0);  ///< sessions there are
  std::atomic<std::uint64_t> next_session{1};
  std::atomic<std::uint16_t> udp_port{0};  ///< what Welcome names; 0: no UDP
  runtime::MetricSink* metrics = &runtime::null_metrics();
  std::function<void(SessionId, const std::string&)> log = [](SessionId, const std::string&) {};  ///< thread-safe
};

/// `place`: what it takes of what its address may have. Enters itself into the registry when it starts and, however it
/// ends, leaves nothing behind: registry and directory entries go, the connection closes, the scheduler hears
/// SessionClosed once if it heard SessionOpened.
class SessionActor : public runtime::Actor<Inbox> {
 public:
  SessionActor(runtime::Context<Inbox> context, SessionId id, std::shared_ptr<SessionSurroundings> surroundings,
               std::shared_ptr<Connection> connection, std::shared_ptr<AddressPlaces::Place> place = nullptr);
  ~SessionActor() override;

  void on_start() override;
  void on(FrameEncoded&& event);
  void on(NoChange&& event);
  void on(CoarseUpdated&& event);
  void on(CloseSession&& command);
  void on(BytesReceived&& event);
  void on(BytesSent&& event);
  void on(SocketClosed&& event);
  void on(DatagramReceived&& event);
  void on(Tick&& event);

 private:
  void act(Actions&& actions);
  void pump();
  void tick_later();
  void finish(const std::string& why);

  void tell_memory() const;

  SessionId id_;
  std::shared_ptr<SessionSurroundings> around_;
  std::shared_ptr<Connection> connection_;
  std::shared_ptr<AddressPlaces::Place> place_;  // until the session ends
  std::unique_ptr<SessionProtocol> protocol_;
  bool opened_ = false;
  bool finished_ = false;
};

}  // namespace darm::session
