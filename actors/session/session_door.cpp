#include "actors/session/session_door.hpp"

#include <string>
#include <utility>

#include "actors/runtime/system.hpp"
#include "proto/darm.pb.h"
#include "proto/framing.hpp"

namespace darm::session {
namespace {

Packets goodbye_full() {
  wire::Envelope envelope;
  envelope.mutable_goodbye()->set_reason(wire::Goodbye::SERVER_FULL);
  envelope.mutable_goodbye()->set_text("The server has as many clients as it may have; try again later.");
  Packets packets(1);
  packets[0].head = proto::frame(envelope);
  return packets;
}

}  // namespace

SessionDoor::SessionDoor(runtime::System& system, std::shared_ptr<SessionSurroundings> surroundings,
                         unsigned max_sessions, std::size_t mailbox)
    : system_(system), around_(std::move(surroundings)), max_sessions_(max_sessions), mailbox_(mailbox) {}

void SessionDoor::admit(const std::shared_ptr<Connection>& connection) {
  if (sessions() >= max_sessions_) {
    metrics().count("darm_session_events_total", 1, {{"what", "server_full"}});
    connection->write(goodbye_full());
    connection->close();
    return;
  }
  const SessionId id{around_->next_session++};
  const auto name = "session/" + std::to_string(static_cast<std::uint64_t>(id));
  // An empty Ref: the daemon is stopping; the connection closes with its last owner.
  if (!system_.spawn<SessionActor>(name, mailbox_, id, around_, connection)) connection->close();
}

}  // namespace darm::session
