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

/// A TLS client begins with byte 0x16; ours without TLS with the length of a small message, whose first byte is 0.
/// Waits ten seconds at most; a client that says nothing or whose handshake fails is closed and `ready` not called.
/// `socket` must have a strand, and comes from `peer`. False: too many are greeted, and it is closed.
bool greet(boost::asio::ip::tcp::socket socket, const std::shared_ptr<boost::asio::ssl::context>& tls,
           PendingSockets& pending, const std::string& peer, std::function<void(std::shared_ptr<Connection>)> ready);

}  // namespace darm::session
