#include "actors/session/tcp_listener.hpp"

#include <algorithm>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <chrono>
#include <utility>

#include "actors/runtime/system.hpp"
#include "actors/session/asio_connection.hpp"

namespace darm::session {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::milliseconds kFirstBackOff{50};
constexpr std::chrono::milliseconds kLongestBackOff{2000};

error_code bind(tcp::acceptor& acceptor, const tcp::endpoint& endpoint) {
  error_code ec;
  acceptor.open(endpoint.protocol(), ec);
  if (!ec) acceptor.set_option(asio::socket_base::reuse_address(true), ec);
  if (!ec) acceptor.bind(endpoint, ec);
  if (!ec) acceptor.listen(asio::socket_base::max_listen_connections, ec);
  return ec;
}

Packet goodbye_full() {
  wire::Envelope envelope;
  envelope.mutable_goodbye()->set_reason(wire::Goodbye::SERVER_FULL);
  envelope.mutable_goodbye()->set_text("The server has as many clients as it may have; try again later.");
  Packet packet;
  packet.head = proto::frame(envelope);
  return packet;
}

}  // namespace

// Everything but `endpoint` is touched on the strand only.
struct TcpListener::State : std::enable_shared_from_this<TcpListener::State> {
  State(asio::io_context& context, runtime::System& s, std::shared_ptr<SessionSurroundings> a,
        const TcpListenerOptions& o)
      : io(context),
        system(s),
        around(std::move(a)),
        options(o),
        strand(asio::make_strand(context)),
        acceptor(strand),
        timer(strand) {}

  void accept() {
    if (stopped) return;
    acceptor.async_accept(asio::make_strand(io), [self = shared_from_this()](error_code ec, tcp::socket socket) {
      if (self->stopped) return;
      if (ec) return self->retry_later(ec);
      self->back_off = kFirstBackOff;
      self->welcome(std::move(socket));
      self->accept();
    });
  }

  void welcome(tcp::socket socket) {
    auto connection = make_connection(std::move(socket));
    if (around->live->load() >= options.max_sessions) {
      around->metrics->count("darm_session_events_total", 1, {{"what", "server_full"}});
      connection->write(goodbye_full());
      connection->close();
      return;
    }
    const SessionId id{around->next_session++};
    const auto name = "session/" + std::to_string(static_cast<std::uint64_t>(id));
    // An empty Ref: the daemon is stopping; the connection closes with its last owner.
    if (!system.spawn<SessionActor>(name, options.mailbox, id, around, connection)) connection->close();
  }

  void retry_later(error_code ec) {
    around->metrics->count("darm_session_events_total", 1, {{"what", "accept_failed"}});
    // Too few descriptors or an aborted client pass by themselves; anything else may be a broken socket.
    const bool passing = ec == asio::error::no_descriptors || ec == asio::error::connection_aborted ||
                         ec == asio::error::no_buffer_space || ec == asio::error::no_memory;
    timer.expires_after(back_off);
    back_off = std::min(back_off * 2, kLongestBackOff);
    timer.async_wait([self = shared_from_this(), passing](error_code cancelled) {
      if (cancelled || self->stopped) return;
      if (!passing) {
        error_code ignored;
        self->acceptor.close(ignored);
        if (const auto again = bind(self->acceptor, self->endpoint)) return self->retry_later(again);
      }
      self->accept();
    });
  }

  asio::io_context& io;
  runtime::System& system;
  std::shared_ptr<SessionSurroundings> around;
  TcpListenerOptions options;
  asio::strand<asio::io_context::executor_type> strand;
  tcp::acceptor acceptor;
  asio::steady_timer timer;
  tcp::endpoint endpoint;
  std::chrono::milliseconds back_off = kFirstBackOff;
  bool stopped = false;
};

TcpListener::TcpListener(std::shared_ptr<State> state) : state_(std::move(state)) {}
TcpListener::~TcpListener() { stop(); }

Result<std::unique_ptr<TcpListener>> TcpListener::open(asio::io_context& io, runtime::System& system,
                                                       std::shared_ptr<SessionSurroundings> surroundings,
                                                       const TcpListenerOptions& options) {
  const std::string where = options.address + ":" + std::to_string(options.port);
  error_code ec;
  const auto address = asio::ip::make_address(options.address, ec);
  if (ec) return fail("tcp " + where + ": not an IP address");
  auto state = std::make_shared<State>(io, system, std::move(surroundings), options);
  ec = bind(state->acceptor, tcp::endpoint(address, options.port));
  if (!ec) state->endpoint = state->acceptor.local_endpoint(ec);
  if (ec) return fail("tcp " + where + ": cannot listen: " + ec.message() + "; choose another port or 0");
  asio::dispatch(state->strand, [state] { state->accept(); });
  return std::unique_ptr<TcpListener>(new TcpListener(std::move(state)));
}

std::uint16_t TcpListener::port() const { return state_->endpoint.port(); }

void TcpListener::stop() {
  asio::dispatch(state_->strand, [state = state_] {
    state->stopped = true;
    error_code ignored;
    state->acceptor.close(ignored);
    state->timer.cancel();
  });
}

}  // namespace darm::session
