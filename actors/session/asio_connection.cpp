#include "actors/session/asio_connection.hpp"

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <utility>

namespace darm::session {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kReadBytes = 16 * 1024;
// Small, so that what cannot be sent waits in our queue, where it can be dropped.
constexpr int kSendBufferBytes = 256 * 1024;
constexpr std::chrono::seconds kLinger{1};

class AsioConnection final : public Connection, public std::enable_shared_from_this<AsioConnection> {
 public:
  explicit AsioConnection(tcp::socket socket)
      : socket_(std::move(socket)), linger_(socket_.get_executor()), incoming_(kReadBytes) {
    error_code ignored;  // without them the session works, only not as well
    socket_.set_option(tcp::no_delay(true), ignored);
    socket_.set_option(asio::socket_base::send_buffer_size(kSendBufferBytes), ignored);
  }

  void attach(runtime::Ref<Inbox> owner) override {
    on_strand([owner = std::move(owner)](AsioConnection& c) mutable { c.owner_ = std::move(owner); });
  }
  void read() override {
    on_strand([](AsioConnection& c) { c.start_read(); });
  }
  void write(Packet packet) override {
    on_strand([p = std::move(packet)](AsioConnection& c) mutable { c.start_write(std::move(p)); });
  }
  void close() override {
    on_strand([](AsioConnection& c) { c.start_close(); });
  }

 private:
  template <class F>
  void on_strand(F&& work) {
    asio::dispatch(socket_.get_executor(),
                   [self = shared_from_this(), work = std::forward<F>(work)]() mutable { work(*self); });
  }

  void start_read() {
    if (reading_ || !socket_.is_open()) return;
    reading_ = true;
    socket_.async_read_some(asio::buffer(incoming_), [self = shared_from_this()](error_code ec, std::size_t n) {
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

  void start_write(Packet packet) {
    if (writing_ || closing_ || !socket_.is_open()) return;
    writing_ = true;
    outgoing_ = std::move(packet);
    const std::array<asio::const_buffer, 3> pieces{
        asio::buffer(outgoing_.head), outgoing_.body ? asio::buffer(*outgoing_.body) : asio::const_buffer(),
        asio::buffer(outgoing_.tail)};
    asio::async_write(socket_, pieces, [self = shared_from_this()](error_code ec, std::size_t n) {
      self->writing_ = false;
      self->outgoing_ = {};
      if (ec && !self->closing_) return self->lost(ec);
      if (self->closing_) return self->end_sending();
      self->owner_.tell(BytesSent(n));
    });
  }

  void start_close() {
    if (closing_) return;
    closing_ = true;
    owner_ = {};
    if (!socket_.is_open()) return;
    linger_.expires_after(kLinger);
    linger_.async_wait([self = shared_from_this()](error_code ec) {
      if (!ec) self->shut();
    });
    if (!writing_) end_sending();
  }

  void end_sending() {
    if (!socket_.is_open()) return;
    error_code ec;
    socket_.shutdown(tcp::socket::shutdown_send, ec);
    if (ec) return shut();
    start_read();
  }

  void shut() {
    linger_.cancel();
    error_code ignored;
    socket_.close(ignored);
  }

  void lost(error_code ec) {
    owner_.tell(SocketClosed(ec == asio::error::eof ? "the client closed it" : ec.message()));
    error_code ignored;
    socket_.close(ignored);
  }

  tcp::socket socket_;
  asio::steady_timer linger_;
  runtime::Ref<Inbox> owner_;
  Bytes incoming_;
  Packet outgoing_;
  bool reading_ = false;
  bool writing_ = false;
  bool closing_ = false;
};

}  // namespace

std::shared_ptr<Connection> make_connection(tcp::socket socket) {
  return std::make_shared<AsioConnection>(std::move(socket));
}

}  // namespace darm::session
