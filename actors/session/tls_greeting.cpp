#include "actors/session/tls_greeting.hpp"

#include <sys/socket.h>

#include <boost/asio/dispatch.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <optional>
#include <utility>

#include "actors/session/asio_connection.hpp"

namespace darm::session {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::seconds kGreetingTime{10};
constexpr std::uint8_t kTlsHandshake = 0x16;

class Greeting : public std::enable_shared_from_this<Greeting> {
 public:
  Greeting(tcp::socket socket, std::shared_ptr<asio::ssl::context> tls, Greeter greeter)
      : tls_(std::move(tls)),
        stream_(std::move(socket), *tls_),
        timer_(lowest().get_executor()),
        greeter_(std::move(greeter)) {}

  void begin(PendingSockets& pending, const std::string& peer) {
    auto place = pending.enter(
        [weak = weak_from_this()] {
          if (const auto self = weak.lock()) self->close_soon();
        },
        peer);
    if (!place) return greeter_.lost("tcp_crowded");  // closed with this object
    place_.emplace(std::move(*place));
    timer_.expires_after(kGreetingTime);
    timer_.async_wait([self = shared_from_this()](error_code ec) {
      if (!ec) self->lose();
    });
    lowest().async_wait(tcp::socket::wait_read, [self = shared_from_this()](error_code ec) { self->look(ec); });
  }

 private:
  tcp::socket& lowest() { return stream_.next_layer(); }

  void close_soon() {
    asio::dispatch(lowest().get_executor(), [self = shared_from_this()] { self->close(); });
  }
  void close() {
    timer_.cancel();
    error_code ignored;
    lowest().close(ignored);
  }
  // What was waited for will not come. Closing ends the other wait too, which finds nothing left to lose.
  void lose(const char* silent = "said_nothing") {
    if (!lowest().is_open()) return;
    close();
    greeter_.lost(hears_ ? "handshake_failed" : silent);
  }

  void look(error_code ec) {
    std::uint8_t first = 0;
    if (ec || !lowest().is_open() || ::recv(lowest().native_handle(), &first, 1, MSG_PEEK | MSG_DONTWAIT) != 1)
      return lose("left_at_once");
    if (first != kTlsHandshake) return finish(make_connection(std::move(lowest())));
    hears_ = true;
    stream_.async_handshake(asio::ssl::stream_base::server, [self = shared_from_this()](error_code failed) {
      if (failed) return self->lose();
      self->finish(make_connection(std::move(self->stream_), self->tls_));
    });
  }

  void finish(std::shared_ptr<Connection> connection) {
    timer_.cancel();
    place_.reset();
    greeter_.ready(std::move(connection));
  }

  std::shared_ptr<asio::ssl::context> tls_;
  TlsSocket stream_;
  asio::steady_timer timer_;
  Greeter greeter_;
  std::optional<PendingSockets::Place> place_;
  bool hears_ = false;  // a handshake has begun
};

}  // namespace

void greet(tcp::socket socket, const std::shared_ptr<asio::ssl::context>& tls, PendingSockets& pending,
           const std::string& peer, Greeter greeter) {
  std::make_shared<Greeting>(std::move(socket), tls, std::move(greeter))->begin(pending, peer);
}

}  // namespace darm::session
