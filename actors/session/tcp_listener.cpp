#include "actors/session/tcp_listener.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <utility>

#include "actors/session/asio_connection.hpp"
#include "actors/session/pending_sockets.hpp"
#include "actors/session/session_door.hpp"
#include "actors/session/socket_acceptor.hpp"
#include "actors/session/tls_greeting.hpp"

namespace darm::session {

namespace asio = boost::asio;
using asio::ip::tcp;

struct TcpListener::State {
  State(runtime::System& system, std::shared_ptr<SessionSurroundings> around, const TcpListenerOptions& options)
      : door(std::make_shared<SessionDoor>(system, std::move(around), options.max_sessions, options.mailbox)),
        tls(options.tls),
        pending(options.max_pending) {}

  void on_socket(tcp::socket socket) {
    const auto peer = peer_of(socket);
    if (!tls) return door->admit(make_connection(std::move(socket)), peer);
    greet(
        std::move(socket), tls, pending, peer,
        {.ready = [door = door, peer](const std::shared_ptr<Connection>& connection) { door->admit(connection, peer); },
         .lost = [door = door](
                     const char* event) { door->metrics().count("darm_session_events_total", 1, {{"what", event}}); }});
  }

  std::shared_ptr<SessionDoor> door;
  std::shared_ptr<asio::ssl::context> tls;
  PendingSockets pending;
  std::unique_ptr<SocketAcceptor> acceptor;
};

TcpListener::TcpListener(std::shared_ptr<State> state) : state_(std::move(state)) {}
TcpListener::~TcpListener() { stop(); }

Result<std::unique_ptr<TcpListener>> TcpListener::open(asio::io_context& io, runtime::System& system,
                                                       std::shared_ptr<SessionSurroundings> surroundings,
                                                       const TcpListenerOptions& options) {
  auto& metrics = *surroundings->metrics;
  auto state = std::make_shared<State>(system, std::move(surroundings), options);
  auto acceptor = SocketAcceptor::open(io, "tcp", options.address, options.port, metrics,
                                       [weak = std::weak_ptr(state)](tcp::socket socket) {
                                         if (const auto self = weak.lock()) self->on_socket(std::move(socket));
                                       });
  if (!acceptor) return std::unexpected(acceptor.error());
  state->acceptor = std::move(*acceptor);
  return std::unique_ptr<TcpListener>(new TcpListener(std::move(state)));
}

std::uint16_t TcpListener::port() const { return state_->acceptor->port(); }

void TcpListener::stop() {
  state_->acceptor->stop();
  state_->pending.close_all();
}

}  // namespace darm::session
