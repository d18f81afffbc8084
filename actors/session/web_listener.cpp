// The only file that includes Beast: it is heavy to compile.
#include "actors/session/web_listener.hpp"

#include <array>
#include <atomic>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/detect_ssl.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/serializer.hpp>
#include <boost/beast/http/span_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <optional>
#include <type_traits>
#include <utility>

#include "actors/session/asio_connection.hpp"
#include "actors/session/pending_sockets.hpp"
#include "actors/session/session_door.hpp"
#include "actors/session/socket_acceptor.hpp"
#include "actors/session/web_reply.hpp"
#include "proto/framing.hpp"
#include "proto/limits.hpp"

namespace darm::session {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kHeaderBytes = 8 * 1024;
constexpr std::chrono::seconds kHandshakeTime{10};
constexpr std::chrono::seconds kRequestTime{15};
constexpr std::chrono::seconds kIdleTime{60};
constexpr std::chrono::seconds kReplyTime{60};
constexpr std::chrono::seconds kLinger{1};

// What all visits of a listener share.
struct House {
  SessionDoor door;
  PendingSockets pending;
  WebListenerOptions options;
  std::atomic<bool> stopping{false};
};

using PlainStream = beast::tcp_stream;
using TlsStream = beast::ssl_stream<beast::tcp_stream>;

beast::tcp_stream& lowest(PlainStream& stream) { return stream; }
beast::tcp_stream& lowest(TlsStream& stream) { return stream.next_layer(); }

std::string_view view_of(beast::string_view text) { return {text.data(), text.size()}; }

// A WebSocket as a Connection: on the inside messages have the length in front that TCP has, on the wire they do not.
template <class Stream>
class WebSocketConnection final : public Connection, public std::enable_shared_from_this<WebSocketConnection<Stream>> {
 public:
  WebSocketConnection(Stream stream, std::shared_ptr<void> keep)
      : keep_(std::move(keep)),
        socket_(std::move(stream)),
        linger_(socket_.get_executor()),
        incoming_(proto::kMaxClientEnvelope) {}

  /// Answers the upgrade, then calls `ready` unless that failed.
  template <class Request, class Ready>
  void accept(Request request, Ready ready) {
    lowest(socket_.next_layer()).expires_never();
    auto timeouts = websocket::stream_base::timeout::suggested(beast::role_type::server);
    timeouts.handshake_timeout = kHandshakeTime;
    socket_.set_option(timeouts);
    socket_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
      response.set(http::field::server, "darmd");
      response.set(http::field::sec_websocket_protocol,
                   beast::string_view(kStreamProtocol.data(), kStreamProtocol.size()));
    }));
    socket_.read_message_max(proto::kMaxClientEnvelope);
    socket_.auto_fragment(false);
    socket_.binary(true);
    auto kept = std::make_shared<Request>(std::move(request));
    socket_.async_accept(*kept, [self = this->shared_from_this(), kept, ready = std::move(ready)](error_code ec) {
      if (!ec) ready(self);
    });
  }

  void attach(runtime::Ref<Inbox> owner) override {
    on_strand([owner = std::move(owner)](auto& c) mutable { c.owner_ = std::move(owner); });
  }
  void read() override {
    on_strand([](auto& c) { c.start_read(); });
  }
  void write(Packets packets) override {
    on_strand([p = std::move(packets)](auto& c) mutable { c.start_write(std::move(p)); });
  }
  void close() override {
    on_strand([](auto& c) { c.start_close(); });
  }

 private:
  template <class F>
  void on_strand(F&& work) {
    asio::dispatch(socket_.get_executor(),
                   [self = this->shared_from_this(), work = std::forward<F>(work)]() mutable { work(*self); });
  }

  void start_read() {
    if (reading_ || closing_ || !socket_.is_open()) return;
    reading_ = true;
    socket_.async_read(incoming_, [self = this->shared_from_this()](error_code ec, std::size_t) {
      self->reading_ = false;
      self->read_done(ec);
    });
  }

  void read_done(error_code ec) {
    if (closing_) return;
    if (ec) return lost(ec == websocket::error::closed ? "the client closed it" : ec.message());
    if (!socket_.got_binary()) return lost("a text message came; messages are binary");
    const auto message = incoming_.data();
    Bytes bytes(proto::kLengthBytes + message.size());
    proto::put_length(static_cast<std::uint32_t>(message.size()), bytes.data());
    std::copy_n(static_cast<const std::uint8_t*>(message.data()), message.size(), bytes.data() + proto::kLengthBytes);
    incoming_.consume(message.size());
    owner_.tell(BytesReceived(std::move(bytes)));
  }

  void start_write(Packets packets) {
    if (writing_ || closing_ || !socket_.is_open()) return;
    writing_ = true;
    outgoing_ = std::move(packets);
    written_ = 0;
    write_message(0);
  }

  // One packet is one message; the next one follows when it is out, without the owner in between.
  void write_message(std::size_t index) {
    const Packet& packet = outgoing_[index];
    std::array<asio::const_buffer, 3> pieces{asio::buffer(packet.head),
                                             packet.body ? asio::buffer(*packet.body) : asio::const_buffer(),
                                             asio::buffer(packet.tail)};
    std::size_t drop = proto::kLengthBytes;
    for (auto& piece : pieces) {
      const auto here = std::min(drop, piece.size());
      piece += here;
      drop -= here;
    }
    socket_.async_write(pieces, [self = this->shared_from_this(), index](error_code ec, std::size_t count) {
      self->written_ += count;
      const bool more = !ec && index + 1 < self->outgoing_.size();
      if (more) return self->write_message(index + 1);
      self->writing_ = false;
      self->outgoing_.clear();
      if (self->closing_) return self->say_close();
      if (ec) return self->lost(ec.message());
      self->owner_.tell(BytesSent(self->written_));
    });
  }

  void start_close() {
    if (closing_) return;
    closing_ = true;
    owner_ = {};
    if (!socket_.is_open()) return;
    linger_.expires_after(kLinger);
    linger_.async_wait([self = this->shared_from_this()](error_code ec) {
      if (!ec) self->shut();
    });
    if (!writing_) say_close();
  }

  void say_close() {
    if (!socket_.is_open()) return shut();
    socket_.async_close(websocket::close_code::normal, [self = this->shared_from_this()](error_code) { self->shut(); });
  }

  void shut() {
    linger_.cancel();
    lowest(socket_.next_layer()).close();
  }

  void lost(const std::string& why) {
    owner_.tell(SocketClosed(why));
    shut();
  }

  std::shared_ptr<void> keep_;
  websocket::stream<Stream> socket_;
  asio::steady_timer linger_;
  beast::flat_buffer incoming_;
  runtime::Ref<Inbox> owner_;
  Packets outgoing_;
  std::size_t written_ = 0;
  bool reading_ = false;
  bool writing_ = false;
  bool closing_ = false;
};

// One connection of a browser, from its first request until it closes or becomes a stream.
template <class Stream>
class Visit : public std::enable_shared_from_this<Visit<Stream>> {
 public:
  Visit(std::shared_ptr<House> house, Stream stream, beast::flat_buffer buffer)
      : house_(std::move(house)), stream_(std::move(stream)), buffer_(std::move(buffer)) {}

  /// `place`: among the pending, given up when this becomes a session or ends.
  void begin() {
    peer_ = peer_of(lowest(stream_).socket());
    place_ = house_->pending.enter(
        [weak = this->weak_from_this()] {
          if (const auto self = weak.lock())
            asio::dispatch(self->stream_.get_executor(), [self] { lowest(self->stream_).close(); });
        },
        peer_);
    if (!place_) return house_->door.metrics().count("darm_session_events_total", 1, {{"what", "web_crowded"}});
    if constexpr (std::is_same_v<Stream, TlsStream>) {
      lowest(stream_).expires_after(kHandshakeTime);
      stream_.async_handshake(asio::ssl::stream_base::server, buffer_.data(),
                              // Beast 1.81 asks for a handler that can be called without the count too.
                              [self = this->shared_from_this()](error_code ec, std::size_t used = 0) {
                                if (ec) return;
                                self->buffer_.consume(used);
                                self->read(kRequestTime);
                              });
    } else {
      read(kRequestTime);
    }
  }

 private:
  void read(std::chrono::seconds patience) {
    parser_.emplace();
    parser_->header_limit(kHeaderBytes);
    lowest(stream_).expires_after(patience);
    http::async_read_header(stream_, buffer_, *parser_, [self = this->shared_from_this()](error_code ec, std::size_t) {
      if (!ec) return self->on_request();
      if (ec == http::error::header_limit || ec == http::error::buffer_overflow)
        return self->send(refusal(431, "The request's header is over 8 KiB."), false);
      if (ec == http::error::body_limit) return self->send(refusal(413, "A request with a body is not taken."), false);
      // Errors of the parser have a reader to tell; those of the socket and of time have not.
      if (ec.category() == make_error_code(http::error::bad_method).category() && ec != http::error::end_of_stream &&
          ec != http::error::partial_message)
        self->send(refusal(400, "The request cannot be read as HTTP/1.1."), false);
    });
  }

  std::string_view header(http::field field) const { return view_of(parser_->get()[field]); }

  void on_request() {
    const auto& request = parser_->get();
    const auto length = parser_->content_length();
    WebRequest asked{view_of(request.method_string()), view_of(request.target()), header(http::field::accept_encoding),
                     header(http::field::if_none_match), (length && *length > 0) || parser_->chunked()};
    if (websocket::is_upgrade(request)) return upgrade(asked);
    const WebHealth health{!house_->stopping, house_->door.sessions(), house_->door.max_sessions(), https_port()};
    send(answer(asked, house_->options.files, health), parser_->keep_alive());
  }

  // The same as this one's: TLS is told apart by the first byte.
  unsigned https_port() {
    error_code ec;
    const auto here = lowest(stream_).socket().local_endpoint(ec);
    return house_->options.tls && !ec ? here.port() : 0;
  }

  void upgrade(const WebRequest& asked) {
    if (asked.target != kStreamPath) return send(refusal(404, "There is no stream under this path."), false);
    if (!origin_allowed(header(http::field::origin), header(http::field::host), house_->options.origins))
      return send(refusal(403, "Pages of this origin may not open a stream here; see web.origins."), false);
    if (!list_has(header(http::field::sec_websocket_protocol), kStreamProtocol))
      return send(refusal(400, "The stream speaks the subprotocol " + std::string(kStreamProtocol) + " only."), false);
    if (buffer_.size() > 0) return send(refusal(400, "The client speaks before it was answered."), false);
    set_stream_options(lowest(stream_).socket());
    count("101");
    auto connection = std::make_shared<WebSocketConnection<Stream>>(std::move(stream_), house_->options.tls);
    connection->accept(parser_->release(),
                       [house = house_, peer = peer_, place = std::make_shared<decltype(place_)>(std::move(place_))](
                           const std::shared_ptr<Connection>& ready) {
                         place->reset();
                         house->door.admit(ready, peer);
                       });
  }

  void count(std::string_view status) {
    house_->door.metrics().count("darm_web_requests_total", 1, {{"status", status}});
  }

  void send(WebReply reply, bool keep_alive) {
    reply_ = std::move(reply);
    keep_alive = keep_alive && !reply_.close && !house_->stopping;
    message_ = {};
    message_.version(11);
    message_.result(reply_.status);
    message_.keep_alive(keep_alive);
    message_.set(http::field::server, "darmd");
    for (const auto& [name, value] : reply_.headers) message_.set(beast::string_view(name.data(), name.size()), value);
    const auto body = reply_.body();
    if (reply_.status != 304) message_.content_length(body.size());
    if (reply_.send_body)
      message_.body() = beast::span<const char>(reinterpret_cast<const char*>(body.data()), body.size());
    count(std::to_string(reply_.status));
    lowest(stream_).expires_after(kReplyTime);
    serializer_.emplace(message_);
    auto done = [self = this->shared_from_this(), keep_alive](error_code ec, std::size_t) {
      if (ec) return;
      if (keep_alive) return self->read(kIdleTime);
      self->end();
    };
    if (reply_.send_body) {
      http::async_write(stream_, *serializer_, std::move(done));
    } else {
      http::async_write_header(stream_, *serializer_, std::move(done));
    }
  }

  void end() {
    lowest(stream_).expires_after(kLinger);
    if constexpr (std::is_same_v<Stream, TlsStream>) {
      stream_.async_shutdown([self = this->shared_from_this()](error_code) {});
    } else {
      error_code ignored;
      stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
      // What the client still says is read and dropped, so that a reset does not overtake the reply.
      drain();
    }
  }

  void drain() {
    buffer_.clear();
    stream_.async_read_some(buffer_.prepare(4096), [self = this->shared_from_this()](error_code ec, std::size_t n) {
      self->drained_ += n;
      if (ec || self->drained_ > 64 * kHeaderBytes) return;
      if constexpr (std::is_same_v<Stream, PlainStream>) self->drain();
    });
  }

  std::shared_ptr<House> house_;
  Stream stream_;
  beast::flat_buffer buffer_;
  std::string peer_;
  std::optional<PendingSockets::Place> place_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  WebReply reply_;
  http::response<http::span_body<const char>> message_;
  std::optional<http::response_serializer<http::span_body<const char>>> serializer_;
  std::size_t drained_ = 0;
};

// A new socket: is it TLS?
class Arrival : public std::enable_shared_from_this<Arrival> {
 public:
  Arrival(std::shared_ptr<House> house, tcp::socket socket)
      : house_(std::move(house)), stream_(std::move(socket)), buffer_(2 * kHeaderBytes) {}

  void begin() {
    place_ = house_->pending.enter(
        [weak = weak_from_this()] {
          if (const auto self = weak.lock())
            asio::dispatch(self->stream_.get_executor(), [self] { self->stream_.close(); });
        },
        peer_of(stream_.socket()));
    if (!place_) return house_->door.metrics().count("darm_session_events_total", 1, {{"what", "web_crowded"}});
    stream_.expires_after(kHandshakeTime);
    beast::async_detect_ssl(stream_, buffer_, [self = shared_from_this()](error_code ec, bool tls) {
      if (!ec) self->detected(tls);
    });
  }

 private:
  void detected(bool tls) {
    place_.reset();
    if (!tls) return std::make_shared<Visit<PlainStream>>(house_, std::move(stream_), std::move(buffer_))->begin();
    const auto& context = house_->options.tls;
    if (!context) return;  // nothing that would be understood can be said
    std::make_shared<Visit<TlsStream>>(house_, TlsStream(std::move(stream_), *context), std::move(buffer_))->begin();
  }

  std::shared_ptr<House> house_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<PendingSockets::Place> place_;
};

}  // namespace

struct WebListener::State {
  std::shared_ptr<House> house;
  std::unique_ptr<SocketAcceptor> acceptor;
};

WebListener::WebListener(std::shared_ptr<State> state) : state_(std::move(state)) {}
WebListener::~WebListener() { stop(); }

Result<std::unique_ptr<WebListener>> WebListener::open(asio::io_context& io, runtime::System& system,
                                                       std::shared_ptr<SessionSurroundings> surroundings,
                                                       WebListenerOptions options) {
  auto& metrics = *surroundings->metrics;
  const auto address = options.address;
  const auto port = options.port;
  SessionDoor door(system, std::move(surroundings), options.max_sessions, options.mailbox);
  PendingSockets pending(options.max_pending);
  auto state = std::make_shared<State>();
  state->house = std::make_shared<House>(std::move(door), std::move(pending), std::move(options));
  auto acceptor = SocketAcceptor::open(io, "web", address, port, metrics, [house = state->house](tcp::socket socket) {
    std::make_shared<Arrival>(house, std::move(socket))->begin();
  });
  if (!acceptor) return std::unexpected(acceptor.error());
  state->acceptor = std::move(*acceptor);
  return std::unique_ptr<WebListener>(new WebListener(std::move(state)));
}

std::uint16_t WebListener::port() const { return state_->acceptor->port(); }

void WebListener::stop() {
  state_->house->stopping = true;
  state_->acceptor->stop();
  state_->house->pending.close_all();
}

}  // namespace darm::session
