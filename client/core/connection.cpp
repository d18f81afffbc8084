#include "client/core/connection.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <span>
#include <thread>
#include <utility>

#include "client/core/byte_stream.hpp"
#include "proto/datagram.hpp"
#include "proto/framing.hpp"
#include "proto/limits.hpp"

namespace darm::client {
namespace {

using std::chrono::milliseconds;

constexpr std::int64_t kClockPingEveryUs = 1'000'000;

// UDP to the peer of a TCP socket, at another port.
Descriptor udp_beside(int tcp, std::uint32_t port) {
  sockaddr_storage peer{};
  socklen_t size = sizeof(peer);
  if (port == 0 || port > 65535 || ::getpeername(tcp, reinterpret_cast<sockaddr*>(&peer), &size) != 0)
    return Descriptor();
  const auto network_port = htons(static_cast<std::uint16_t>(port));
  if (peer.ss_family == AF_INET) reinterpret_cast<sockaddr_in*>(&peer)->sin_port = network_port;
  if (peer.ss_family == AF_INET6) reinterpret_cast<sockaddr_in6*>(&peer)->sin6_port = network_port;
  Descriptor fd(::socket(peer.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (fd.get() < 0 || ::connect(fd.get(), reinterpret_cast<sockaddr*>(&peer), size) != 0) return Descriptor();
  return fd;
}

Cause cause_of(wire::Goodbye::Reason reason) {
  switch (reason) {
    case wire::Goodbye::SERVER_FULL:
      return Cause::kFull;
    case wire::Goodbye::VERSION_UNSUPPORTED:
      return Cause::kVersion;
    case wire::Goodbye::FORMAT_REFUSED:
      return Cause::kRefused;
    case wire::Goodbye::PROTOCOL_ERROR:
      return Cause::kProtocol;
    default:
      return Cause::kOther;
  }
}

Error farewell(const wire::Goodbye& g) {
  std::string reason = wire::Goodbye::Reason_Name(g.reason());
  if (reason.empty()) reason = "UNSPECIFIED";
  std::string text = g.text().substr(0, proto::kMaxGoodbyeText);
  std::replace_if(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 32; }, ' ');
  return Error("the server says goodbye: " + reason + (text.empty() ? "" : " (" + text + ")"), cause_of(g.reason()));
}

Error protocol_fault(std::string text) { return Error("server: " + std::move(text), Cause::kProtocol); }

}  // namespace

std::int64_t now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch()).count();
}

struct Connection::State {
  ConnectOptions options;
  std::unique_ptr<ByteStream> tcp;
  Descriptor udp, wake;
  wire::Welcome welcome;
  std::optional<proto::SipKey> key;
  std::uint64_t datagram_sequence = 0;
  std::atomic<std::uint64_t> camera_sequence{0};
  std::mutex send_mutex;  // TCP and UDP sending, sequences
  bool said_goodbye = false;

  std::mutex mutex;  // queue
  std::condition_variable changed;
  std::deque<Received> queue;
  std::size_t queued_bytes = 0;
  bool ended = false;
  Error end_reason{"connection is closed"};

  std::int64_t shortest_ping_us = 0, clock_ahead = 0;  // with `mutex`
  bool pong_came = false;
  std::int64_t next_clock_ping_us = 0;  // of the reader

  std::atomic<std::uint64_t> received{0}, sent{0};
  std::atomic<std::int64_t> last_sent_us{0};
  std::atomic<bool> stopping{false};
  std::thread reader;

  Result<void> send_tcp(const wire::Envelope& envelope);
  Result<void> send_body(wire::DatagramBody body);
  void read_loop();
  Result<void> read_some(proto::FrameReader& frames);
  bool take(Received message);
  void keep_alive();
  void take_pong(const wire::Pong& pong, std::int64_t at_us);
  void end(Error reason);
};

Result<void> Connection::State::send_tcp(const wire::Envelope& envelope) {
  const auto bytes = proto::frame(envelope);
  const std::lock_guard lock(send_mutex);
  if (auto ok = tcp->send(bytes, options.connect_timeout); !ok) return ok;
  sent += bytes.size();
  last_sent_us = now_us();
  return {};
}

Result<void> Connection::State::send_body(wire::DatagramBody body) {
  if (udp.get() >= 0 && key) {
    const std::lock_guard lock(send_mutex);
    const auto bytes = proto::seal_datagram(*key, welcome.session(), ++datagram_sequence, body);
    // A lost datagram is replaced by the next one, so a failure to send is no error.
    if (::send(udp.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) > 0) sent += bytes.size();
    return {};
  }
  wire::Envelope envelope;
  if (body.has_camera()) *envelope.mutable_camera() = std::move(*body.mutable_camera());
  if (body.has_feedback()) *envelope.mutable_feedback() = std::move(*body.mutable_feedback());
  return send_tcp(envelope);
}

void Connection::State::end(Error reason) {
  const std::lock_guard lock(mutex);
  if (!ended) end_reason = std::move(reason);
  ended = true;
  changed.notify_all();
}

// Queues a message, waiting while the queue is full. False: stop reading.
bool Connection::State::take(Received message) {
  if (message.envelope.has_pong()) {
    take_pong(message.envelope.pong(), message.at_us);
    return true;
  }
  if (message.envelope.has_ping()) {
    wire::Envelope pong;
    pong.mutable_pong()->set_time_us(message.envelope.ping().time_us());
    return send_tcp(pong).has_value();
  }
  if (message.envelope.has_goodbye()) {
    end(farewell(message.envelope.goodbye()));
    return false;
  }
  std::unique_lock lock(mutex);
  changed.wait(lock,
               [&] { return stopping || queue.empty() || queued_bytes + message.bytes <= options.max_queued_bytes; });
  if (stopping) return false;
  queued_bytes += message.bytes;
  queue.push_back(std::move(message));
  changed.notify_all();
  return true;
}

void Connection::State::take_pong(const wire::Pong& pong, std::int64_t at_us) {
  const std::int64_t took = at_us - pong.time_us();
  const std::lock_guard lock(mutex);
  if (pong.server_time_us() == 0 || took < 0 || (pong_came && took >= shortest_ping_us)) return;
  pong_came = true;
  shortest_ping_us = took;
  clock_ahead = pong.server_time_us() - (pong.time_us() + took / 2);
}

// TCP counts as life for the server only if something is sent now and then.
void Connection::State::keep_alive() {
  const std::int64_t now = now_us();
  const bool clock_due = options.measure_clock && now >= next_clock_ping_us;
  if (!clock_due && now - last_sent_us < (proto::kPingEverySeconds - 2) * 1'000'000) return;
  next_clock_ping_us = now + kClockPingEveryUs;
  wire::Envelope ping;
  ping.mutable_ping()->set_time_us(now);
  if (auto ok = send_tcp(ping); !ok) end(ok.error());
}

// Reads what is there and queues whole messages; an error is the reason to end.
Result<void> Connection::State::read_some(proto::FrameReader& frames) {
  std::array<std::uint8_t, 65536> buffer;
  const auto n = tcp->receive(buffer);
  if (!n) return std::unexpected(n.error());
  received += *n;
  frames.feed(std::span(buffer.data(), *n));
  for (;;) {
    Received message;
    const std::size_t before = frames.buffered();
    const auto got = frames.next(message.envelope);
    if (!got) return std::unexpected(protocol_fault(got.error()));
    if (!*got) return {};
    message.bytes = before - frames.buffered();
    message.bytes_total = received - frames.buffered();
    message.at_us = now_us();
    if (!take(std::move(message))) return fail("connection is closed");
  }
}

void Connection::State::read_loop() {
  proto::FrameReader frames(proto::kMaxServerEnvelope);
  std::int64_t last_heard = now_us();
  while (!stopping) {
    std::array<pollfd, 2> fds{{{tcp->socket(), POLLIN, 0}, {wake.get(), POLLIN, 0}}};
    const bool held = tcp->holds_bytes();
    const int ready = ::poll(fds.data(), fds.size(), held ? 0 : 500);
    if (stopping) break;
    if (ready < 0 && errno != EINTR) return end(Error(std::string("poll: ") + std::strerror(errno)));
    if (held || fds[0].revents != 0) {
      if (auto ok = read_some(frames); !ok) return end(ok.error());
      last_heard = now_us();
    } else if (now_us() - last_heard > options.silence_timeout.count() * 1000) {
      return end(Error("server: silent for too long"));
    }
    keep_alive();
  }
  end(Error("connection is closed"));
}

Connection::Connection(std::unique_ptr<State> state) : state_(std::move(state)) {}

namespace {

wire::Envelope hello_of(const ConnectOptions& options) {
  wire::Envelope envelope;
  auto& hello = *envelope.mutable_hello();
  hello.set_version(proto::kProtocolVersion);
  hello.set_client(options.name.substr(0, proto::kMaxClientName));
  if (options.view) *hello.mutable_pose() = to_pose(*options.view);
  hello.set_max_phystex(options.max_phystex);
  hello.set_chroma_444(options.chroma_444);
  hello.set_lossless(options.lossless);
  hello.set_max_view_phystex(options.max_view_phystex);
  hello.set_target_error(options.target_error);
  hello.set_known_scene(options.known_scene);
  return envelope;
}

// The server's first message, or why there is none.
Result<wire::Welcome> await_welcome(Connection& connection, const ConnectOptions& options) {
  constexpr milliseconds kSlice{50};
  std::optional<Received> first;
  for (auto left = options.handshake_timeout; !first; left -= kSlice) {
    if (options.stop.stop_requested()) return fail("connection is closed");
    if (left.count() <= 0) return fail("server: no welcome in time");
    auto got = connection.next(std::min(left, kSlice));
    if (!got) return std::unexpected(got.error());
    first = std::move(*got);
  }
  if (!first->envelope.has_welcome()) return std::unexpected(protocol_fault("its first message is not a welcome"));
  const wire::Welcome& welcome = first->envelope.welcome();
  if (welcome.version() != proto::kProtocolVersion)
    return fail(
        fmt::format("server: speaks protocol version {}, this client {}", welcome.version(), proto::kProtocolVersion),
        Cause::kVersion);
  if (welcome.view_phystex() > options.max_view_phystex)
    return std::unexpected(protocol_fault(fmt::format("offers a private layer of {} pixels, asked for was {}",
                                                      welcome.view_phystex(), options.max_view_phystex)));
  return welcome;
}

}  // namespace

Result<std::unique_ptr<Connection>> Connection::open(const ConnectOptions& options) {
  auto tcp = ByteStream::open(
      {options.host, options.port, options.tls, options.authority, options.connect_timeout, options.stop});
  if (!tcp) return std::unexpected(tcp.error());
  auto state = std::make_unique<State>();
  state->options = options;
  state->tcp = std::move(*tcp);
  state->wake = Descriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  const wire::Envelope envelope = hello_of(options);
  if (auto ok = state->send_tcp(envelope); !ok) return std::unexpected(ok.error());
  std::unique_ptr<Connection> connection(new Connection(std::move(state)));
  State& s = *connection->state_;
  s.reader = std::thread([&s] { s.read_loop(); });

  auto welcome = await_welcome(*connection, options);
  if (!welcome) return std::unexpected(welcome.error());
  s.welcome = std::move(*welcome);
  s.key = proto::datagram_key(s.welcome.key());
  // Datagrams are authenticated, not encrypted: who asked for TLS gets it for all.
  if (s.key && options.udp && options.tls == Tls::kNone) s.udp = udp_beside(s.tcp->socket(), s.welcome.udp_port());
  return connection;
}

Connection::~Connection() {
  goodbye();
  {
    const std::lock_guard lock(state_->mutex);
    state_->stopping = true;
    state_->changed.notify_all();
  }
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(state_->wake.get(), &one, sizeof(one));
  if (state_->reader.joinable()) state_->reader.join();
}

const wire::Welcome& Connection::welcome() const { return state_->welcome; }
std::uint64_t Connection::bytes_received() const { return state_->received; }
std::uint64_t Connection::bytes_sent() const { return state_->sent; }
bool Connection::uses_udp() const { return state_->udp.get() >= 0; }

std::optional<std::int64_t> Connection::server_clock_ahead() const {
  const std::lock_guard lock(state_->mutex);
  return state_->pong_came ? std::optional(state_->clock_ahead) : std::nullopt;
}

Result<std::optional<Received>> Connection::next(milliseconds timeout) {
  State& s = *state_;
  std::unique_lock lock(s.mutex);
  s.changed.wait_for(lock, timeout, [&] { return !s.queue.empty() || s.ended; });
  if (!s.queue.empty()) {
    std::optional<Received> message(std::move(s.queue.front()));
    s.queue.pop_front();
    s.queued_bytes -= message->bytes;
    s.changed.notify_all();
    return message;
  }
  if (s.ended) return std::unexpected(s.end_reason);
  return std::optional<Received>();
}

Result<std::uint64_t> Connection::send_camera(const View& view) {
  wire::DatagramBody body;
  auto& camera = *body.mutable_camera();
  const std::uint64_t sequence = ++state_->camera_sequence;
  camera.set_sequence(sequence);
  camera.set_client_time_us(now_us());
  *camera.mutable_pose() = to_pose(view);
  if (auto ok = state_->send_body(std::move(body)); !ok) return std::unexpected(ok.error());
  return sequence;
}

Result<void> Connection::send_feedback(const wire::Feedback& feedback) {
  if (feedback.key_frame_wanted()) {  // must not get lost
    wire::Envelope envelope;
    *envelope.mutable_feedback() = feedback;
    return state_->send_tcp(envelope);
  }
  wire::DatagramBody body;
  *body.mutable_feedback() = feedback;
  return state_->send_body(std::move(body));
}

void Connection::goodbye() {
  {
    const std::lock_guard lock(state_->mutex);
    if (std::exchange(state_->said_goodbye, true) || state_->ended) return;
  }
  wire::Envelope envelope;
  envelope.mutable_goodbye()->set_reason(wire::Goodbye::CLIENT_LEAVES);
  if (state_->send_tcp(envelope)) state_->tcp->finish();
}

Result<void> parse_address(const std::string& text, std::string& host, std::uint16_t& port) {
  const auto colon = text.rfind(':');
  const auto bad = [&] { return fail("server " + text + ": expected HOST:PORT"); };
  if (colon == std::string::npos || colon == 0) return bad();
  host = text.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  const char* end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data() + colon + 1, end, port);
  if (parsed.ec != std::errc() || parsed.ptr != end || port == 0) return bad();
  return {};
}

}  // namespace darm::client
