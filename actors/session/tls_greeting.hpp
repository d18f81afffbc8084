// Finds out whether a new socket on the TCP port speaks TLS, and does its handshake.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <functional>
#include <memory>
#include <string>

#include "actors/session/connection.hpp"
#include "actors/session/pending_sockets.hpp"

namespace darm::session {

/// What becomes of a socket: one of both is called, from its strand, unless the server stops.
struct Greeter {
  std::function<void(std::shared_ptr<Connection>)> ready;
  std::function<void(const char* event)> lost;  ///< it is closed; what darm_session_events_total counts
};
/// A TLS client begins with byte 0x16; ours without TLS with the length of a small message, whose first byte is 0.
/// Waits ten seconds at most; a client that says nothing, goes before it has, or whose handshake fails is closed, and
/// instead of `ready` one of the events "said_nothing", "left_at_once" and "handshake_failed" is counted, unless the
/// server stops. `socket` must have a strand, and comes from `peer`. Too many are greeted: it is closed, "tcp_crowded".
void greet(boost::asio::ip::tcp::socket socket, const std::shared_ptr<boost::asio::ssl::context>& tls,
           PendingSockets& pending, const std::string& peer, Greeter greeter);

}  // namespace darm::session
