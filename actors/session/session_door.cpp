#include "actors/session/session_door.hpp"

#include <string>
#include <utility>

#include "actors/runtime/system.hpp"
#include "proto/darm.pb.h"
#include "proto/framing.hpp"

namespace darm::session {
namespace {

Packets goodbye_full(const char* text) {
  wire::Envelope envelope;
  envelope.mutable_goodbye()->set_reason(wire::Goodbye::SERVER_FULL);
  envelope.mutable_goodbye()->set_text(text);
  Packets packets(1);
  packets[0].head = proto::frame(envelope);
  return packets;
}

}  // namespace

SessionDoor::SessionDoor(runtime::System& system, std::shared_ptr<SessionSurroundings> surroundings,
                         unsigned max_sessions, std::size_t mailbox)
    : system_(system), around_(std::move(surroundings)), max_sessions_(max_sessions), mailbox_(mailbox) {}

void SessionDoor::refuse(Connection& connection, std::string_view what, const char* text) const {
  metrics().count("darm_session_events_total", 1, {{"what", what}});
  connection.write(goodbye_full(text));
  connection.close();
}

void SessionDoor::admit(const std::shared_ptr<Connection>& connection, const std::string& peer) {
  if (sessions() >= max_sessions_)
    return refuse(*connection, "server_full", "The server has as many clients as it may have; try again later.");
  if (!around_->policy.memory->has_room(0))
    return refuse(*connection, "memory_full", "The server holds as much for its clients as it may; try again later.");
  auto place = around_->addresses->enter(peer);
  if (!place)
    return refuse(*connection, "address_full", "There are as many clients from this address as there may be.");
  const SessionId id{around_->next_session++};
  const auto name = "session/" + std::to_string(static_cast<std::uint64_t>(id));
  // An empty Ref: the daemon is stopping; the connection closes with its last owner.
  if (!system_.spawn<SessionActor>(name, mailbox_, id, around_, connection,
                                   std::make_shared<AddressPlaces::Place>(std::move(*place))))
    connection->close();
}

}  // namespace darm::session
