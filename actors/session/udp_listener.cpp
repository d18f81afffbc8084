#include "actors/session/udp_listener.hpp"

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <chrono>
#include <utility>

#include "proto/limits.hpp"

namespace darm::session {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

constexpr std::chrono::milliseconds kBackOff{100};

}  // namespace

struct UdpListener::State : std::enable_shared_from_this<UdpListener::State> {
  State(asio::io_context& io, std::shared_ptr<SessionSurroundings> a)
      : around(std::move(a)), strand(asio::make_strand(io)), socket(strand), timer(strand) {}

  void receive() {
    if (stopped) return;
    socket.async_receive_from(asio::buffer(buffer), sender, [self = shared_from_this()](error_code ec, std::size_t n) {
      if (self->stopped) return;
      if (ec) return self->receive_later();
      self->deliver(n);
      self->receive();
    });
  }

  void deliver(std::size_t count) {
    auto opened = around->datagrams->open(std::span<const std::uint8_t>(buffer).first(count));
    if (!opened) {
      around->metrics->count("darm_datagrams_dropped_total", 1, {{"reason", proto::to_string(opened.error())}});
      return;
    }
    around->sessions->find(opened->session).tell(DatagramReceived(std::move(opened->body)));
  }

  void receive_later() {
    timer.expires_after(kBackOff);
    timer.async_wait([self = shared_from_this()](error_code ec) {
      if (!ec) self->receive();
    });
  }

  std::shared_ptr<SessionSurroundings> around;
  asio::strand<asio::io_context::executor_type> strand;
  udp::socket socket;
  asio::steady_timer timer;
  udp::endpoint sender;
  std::uint16_t port = 0;
  std::array<std::uint8_t, proto::kMaxDatagram + 1> buffer{};  // one more: a longer datagram shows itself
  bool stopped = false;
};

UdpListener::UdpListener(std::shared_ptr<State> state) : state_(std::move(state)) {}
UdpListener::~UdpListener() { stop(); }

Result<std::unique_ptr<UdpListener>> UdpListener::open(asio::io_context& io,
                                                       std::shared_ptr<SessionSurroundings> surroundings,
                                                       const std::string& address, std::uint16_t port) {
  const std::string where = address + ":" + std::to_string(port);
  error_code ec;
  const auto ip = asio::ip::make_address(address, ec);
  if (ec) return fail("udp " + where + ": not an IP address");
  auto state = std::make_shared<State>(io, std::move(surroundings));
  const udp::endpoint endpoint(ip, port);
  state->socket.open(endpoint.protocol(), ec);
  if (!ec) state->socket.bind(endpoint, ec);
  if (!ec) state->port = state->socket.local_endpoint(ec).port();
  if (ec) return fail("udp " + where + ": cannot bind: " + ec.message() + "; choose another port or 0");
  state->around->udp_port = state->port;
  asio::dispatch(state->strand, [state] { state->receive(); });
  return std::unique_ptr<UdpListener>(new UdpListener(std::move(state)));
}

std::uint16_t UdpListener::port() const { return state_->port; }

void UdpListener::stop() {
  asio::dispatch(state_->strand, [state = state_] {
    state->stopped = true;
    error_code ignored;
    state->socket.close(ignored);
    state->timer.cancel();
  });
}

}  // namespace darm::session
