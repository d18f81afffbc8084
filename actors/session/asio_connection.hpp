// A TCP socket, bare or under TLS, as a Connection.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <memory>
#include <string>

#include "actors/session/connection.hpp"

namespace darm::session {

using TlsSocket = boost::asio::ssl::stream<boost::asio::ip::tcp::socket>;

/// `socket` must have an executor that runs one handler at a time (a strand). Lives until its last operation is done.
/// Closing sends what was written, then waits a second at most for the other side to close, so that a last message is
/// not lost to a reset.
[[nodiscard]] std::shared_ptr<Connection> make_connection(boost::asio::ip::tcp::socket socket);
/// The same under TLS, after its handshake. Keeps `context`.
[[nodiscard]] std::shared_ptr<Connection> make_connection(TlsSocket socket,
                                                          std::shared_ptr<boost::asio::ssl::context> context);

/// What both listeners ask of a socket: no delay, and a send buffer so small that what cannot be sent waits in our
/// queue, where it can be dropped.
void set_stream_options(boost::asio::ip::tcp::socket& socket);

/// Who is at the other end, for what one address may have: an IPv4 address, or the /64 of an IPv6 one, all of which
/// whoever has one of them has. Empty: the connection is gone.
[[nodiscard]] std::string peer_of(const boost::asio::ip::tcp::socket& socket);
[[nodiscard]] std::string peer_of(const boost::asio::ip::address& address);

}  // namespace darm::session
