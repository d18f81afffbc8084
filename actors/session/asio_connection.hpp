// A TCP socket as a Connection.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <memory>

#include "actors/session/connection.hpp"

namespace darm::session {

/// `socket` must have an executor that runs one handler at a time (a strand). Lives until its last operation is done.
/// Closing sends what was written, then waits a second at most for the other side to close, so that a last message is
/// not lost to a reset.
[[nodiscard]] std::shared_ptr<Connection> make_connection(boost::asio::ip::tcp::socket socket);

}  // namespace darm::session
