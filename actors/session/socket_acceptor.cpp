#include "actors/session/socket_acceptor.hpp"

#include <algorithm>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <chrono>
#include <utility>

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

}  // namespace

// Everything but `endpoint` is touched on the strand only.
struct SocketAcceptor::State : std::enable_shared_from_this<SocketAcceptor::State> {
  State(asio::io_context& context, runtime::MetricSink& sink, OnSocket handler)
      : io(context),
        metrics(sink),
        on_socket(std::move(handler)),
        strand(asio::make_strand(context)),
        acceptor(strand),
        timer(strand) {}

  void accept() {
    if (stopped) return;
    acceptor.async_accept(asio::make_strand(io), [self = shared_from_this()](error_code ec, tcp::socket socket) {
      if (self->stopped) return;
      if (ec) return self->retry_later(ec);
      self->back_off = kFirstBackOff;
      self->on_socket(std::move(socket));
      self->accept();
    });
  }

  void retry_later(error_code ec) {
    metrics.count("darm_session_events_total", 1, {{"what", "accept_failed"}});
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
  runtime::MetricSink& metrics;
  OnSocket on_socket;
  asio::strand<asio::io_context::executor_type> strand;
  tcp::acceptor acceptor;
  asio::steady_timer timer;
  tcp::endpoint endpoint;
  std::chrono::milliseconds back_off = kFirstBackOff;
  bool stopped = false;
};

SocketAcceptor::SocketAcceptor(std::shared_ptr<State> state) : state_(std::move(state)) {}
SocketAcceptor::~SocketAcceptor() { stop(); }

Result<std::unique_ptr<SocketAcceptor>> SocketAcceptor::open(asio::io_context& io, const std::string& name,
                                                             const std::string& address, std::uint16_t port,
                                                             runtime::MetricSink& metrics, OnSocket on_socket) {
  const std::string where = name + " " + address + ":" + std::to_string(port);
  error_code ec;
  const auto ip = asio::ip::make_address(address, ec);
  if (ec) return fail(where + ": not an IP address");
  auto state = std::make_shared<State>(io, metrics, std::move(on_socket));
  ec = bind(state->acceptor, tcp::endpoint(ip, port));
  if (!ec) state->endpoint = state->acceptor.local_endpoint(ec);
  if (ec) return fail(where + ": cannot listen: " + ec.message() + "; choose another port or 0");
  asio::dispatch(state->strand, [state] { state->accept(); });
  return std::unique_ptr<SocketAcceptor>(new SocketAcceptor(std::move(state)));
}

std::uint16_t SocketAcceptor::port() const { return state_->endpoint.port(); }

void SocketAcceptor::stop() {
  asio::dispatch(state_->strand, [state = state_] {
    state->stopped = true;
    error_code ignored;
    state->acceptor.close(ignored);
    state->timer.cancel();
  });
}

}  // namespace darm::session
