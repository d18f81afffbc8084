#include "actors/session/asio_connection.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <type_traits>
#include <utility>
#include <vector>

namespace darm::session {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kReadBytes = 16 * 1024;
// Small, so that what cannot be sent waits in our queue, where it can be dropped.
constexpr int kSendBufferBytes = 256 * 1024;
// What the kernel may hold beyond what is on its way: newer messages wait behind it.
constexpr int kUnsentBytes = 64 * 1024;
constexpr std::chrono::seconds kLinger{1};

// Stream: tcp::socket or TlsSocket.
template <class Stream>
class AsioConnection final : public Connection, public std::enable_shared_from_this<AsioConnection<Stream>> {
 public:
  /// `keep`: what `stream` needs to live.
  explicit AsioConnection(Stream stream, std::shared_ptr<void> keep)
      : keep_(std::move(keep)), stream_(std::move(stream)), linger_(socket().get_executor()), incoming_(kReadBytes) {
    set_stream_options(socket());
  }

  void attach(runtime::Ref<Inbox> owner) override {
    on_strand([owner = std::move(owner)](AsioConnection& c) mutable { c.owner_ = std::move(owner); });
  }
  void read() override {
    on_strand([](AsioConnection& c) { c.start_read(); });
  }
  void write(Packets packets) override {
    on_strand([p = std::move(packets)](AsioConnection& c) mutable { c.start_write(std::move(p)); });
  }
  void close() override {
    on_strand([](AsioConnection& c) { c.start_close(); });
  }

 private:
  static constexpr bool kTls = std::is_same_v<Stream, TlsSocket>;

  tcp::socket& socket() {
    if constexpr (kTls) {
      return stream_.next_layer();
    } else {
      return stream_;
    }
  }

  template <class F>
  void on_strand(F&& work) {
    asio::dispatch(socket().get_executor(),
                   [self = this->shared_from_this(), work = std::forward<F>(work)]() mutable { work(*self); });
  }

  void start_read() {
    if (reading_ || !socket().is_open()) return;
    reading_ = true;
    stream_.async_read_some(asio::buffer(incoming_), [self = this->shared_from_this()](error_code ec, std::size_t n) {
      self->reading_ = false;
      self->read_done(ec, n);
    });
  }

  void read_done(error_code ec, std::size_t count) {
    if (ec) {
      if (closing_) return shut();
      return lost(ec);
    }
    if (closing_) return start_read();  // nobody listens any more: read on until the other side closes
    const auto end = incoming_.begin() + static_cast<std::ptrdiff_t>(count);
    owner_.tell(BytesReceived(Bytes(incoming_.begin(), end)));
  }

  void start_write(Packets packets) {
    if (writing_ || closing_ || !socket().is_open()) return;
    writing_ = true;
    outgoing_ = std::move(packets);
    std::vector<asio::const_buffer> pieces;
    for (const auto& packet : outgoing_) {
      pieces.push_back(asio::buffer(packet.head));
      if (packet.body) pieces.push_back(asio::buffer(*packet.body));
      if (!packet.tail.empty()) pieces.push_back(asio::buffer(packet.tail));
    }
    asio::async_write(stream_, pieces, [self = this->shared_from_this()](error_code ec, std::size_t n) {
      self->writing_ = false;
      self->outgoing_.clear();
      if (ec && !self->closing_) return self->lost(ec);
      if (self->closing_) return self->end_sending();
      self->owner_.tell(BytesSent(n));
    });
  }

  void start_close() {
    if (closing_) return;
    closing_ = true;
    owner_ = {};
    if (!socket().is_open()) return;
    linger_.expires_after(kLinger);
    linger_.async_wait([self = this->shared_from_this()](error_code ec) {
      if (!ec) self->shut();
    });
    if (!writing_) end_sending();
  }

  void end_sending() {
    if (!socket().is_open()) return;
    if constexpr (kTls) {
      // Says so under TLS and waits for the other side to say it too; `linger_` bounds it.
      stream_.async_shutdown([self = this->shared_from_this()](error_code) { self->shut(); });
    } else {
      error_code ec;
      socket().shutdown(tcp::socket::shutdown_send, ec);
      if (ec) return shut();
      start_read();
    }
  }

  void shut() {
    linger_.cancel();
    error_code ignored;
    socket().close(ignored);
  }

  void lost(error_code ec) {
    const bool ended = ec == asio::error::eof || ec == asio::ssl::error::stream_truncated;
    owner_.tell(SocketClosed(ended ? "the client closed it" : ec.message()));
    error_code ignored;
    socket().close(ignored);
  }

  std::shared_ptr<void> keep_;
  Stream stream_;
  asio::steady_timer linger_;
  runtime::Ref<Inbox> owner_;
  Bytes incoming_;
  Packets outgoing_;
  bool reading_ = false;
  bool writing_ = false;
  bool closing_ = false;
};

}  // namespace

void set_stream_options(tcp::socket& socket) {
  error_code ignored;  // without them the session works, only not as well
  socket.set_option(tcp::no_delay(true), ignored);
  socket.set_option(asio::socket_base::send_buffer_size(kSendBufferBytes), ignored);
  setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytes, sizeof kUnsentBytes);
}

std::string peer_of(const tcp::socket& socket) {
  error_code ec;
  const auto endpoint = socket.remote_endpoint(ec);
  return ec ? std::string() : peer_of(endpoint.address());
}

std::string peer_of(const asio::ip::address& address) {
  if (address.is_v4()) return address.to_string();
  const auto v6 = address.to_v6();
  if (v6.is_v4_mapped()) return asio::ip::make_address_v4(asio::ip::v4_mapped, v6).to_string();
  auto bytes = v6.to_bytes();
  std::fill(bytes.begin() + 8, bytes.end(), std::uint8_t{0});
  return asio::ip::address_v6(bytes).to_string() + "/64";
}

std::shared_ptr<Connection> make_connection(tcp::socket socket) {
  return std::make_shared<AsioConnection<tcp::socket>>(std::move(socket), nullptr);
}

std::shared_ptr<Connection> make_connection(TlsSocket socket, std::shared_ptr<asio::ssl::context> context) {
  return std::make_shared<AsioConnection<TlsSocket>>(std::move(socket), std::move(context));
}

}  // namespace darm::session
