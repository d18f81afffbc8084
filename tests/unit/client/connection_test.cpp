#include "client/core/connection.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <functional>
#include <span>
#include <thread>

#include "proto/datagram.hpp"
#include "proto/framing.hpp"
#include "proto/limits.hpp"
#include "tests/unit/client/peer.hpp"

namespace darm::client {
namespace {

using namespace std::chrono_literals;

class FakeServer {
 public:
  explicit FakeServer(std::function<void(Peer&)> script) {
    listener_ = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    EXPECT_EQ(::listen(listener_, 1), 0);
    socklen_t size = sizeof(address);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port = ntohs(address.sin_port);
    thread_ = std::thread([this, script = std::move(script)] {
      Peer peer(::accept(listener_, nullptr, nullptr));
      script(peer);
    });
  }
  ~FakeServer() {
    thread_.join();
    ::close(listener_);
  }
  FakeServer(const FakeServer&) = delete;
  FakeServer& operator=(const FakeServer&) = delete;
  std::uint16_t port = 0;

 private:
  int listener_ = -1;
  std::thread thread_;
};

wire::Envelope welcome(std::uint32_t udp_port = 0) {
  wire::Envelope e;
  e.mutable_welcome()->set_version(proto::kProtocolVersion);
  e.mutable_welcome()->set_session(77);
  e.mutable_welcome()->set_key(std::string(proto::kSessionKeyBytes, 'k'));
  e.mutable_welcome()->set_udp_port(udp_port);
  e.mutable_welcome()->set_phystex_size(1024);
  return e;
}

ConnectOptions to(std::uint16_t port) {
  ConnectOptions o;
  o.host = "127.0.0.1";
  o.port = port;
  o.lossless = true;
  o.handshake_timeout = 5s;
  return o;
}

TEST(Connection, ShakesHandsTalksAndSaysGoodbye) {
  FakeServer server([](Peer& peer) {
    const auto hello = peer.read();
    EXPECT_TRUE(hello.has_hello());
    EXPECT_TRUE(hello.hello().lossless());
    EXPECT_EQ(hello.hello().version(), proto::kProtocolVersion);
    peer.send(welcome());
    const auto camera = peer.read();
    EXPECT_EQ(camera.camera().sequence(), 1u);
    wire::Envelope ping;
    ping.mutable_ping()->set_time_us(5);
    peer.send(ping);
    wire::Envelope answer;
    answer.mutable_no_change()->set_answers(1);
    peer.send(answer);
    EXPECT_EQ(peer.read().pong().time_us(), 5);
    EXPECT_EQ(peer.read().goodbye().reason(), wire::Goodbye::CLIENT_LEAVES);
  });
  auto connection = Connection::open(to(server.port));
  ASSERT_TRUE(connection) << connection.error().message;
  EXPECT_EQ((*connection)->welcome().session(), 77u);
  EXPECT_FALSE((*connection)->uses_udp());
  const auto sequence = (*connection)->send_camera(look_at({0, 0, 0}, {1, 0, 0}, 60, 64, 64));
  ASSERT_TRUE(sequence);
  EXPECT_EQ(*sequence, 1u);
  const auto message = (*connection)->next(5s);
  ASSERT_TRUE(message && *message);
  EXPECT_EQ((*message)->envelope.no_change().answers(), 1u);
  EXPECT_EQ((*message)->bytes_total, (*connection)->bytes_received());
}

TEST(Connection, MeasuresTheServersClock) {
  constexpr std::int64_t kAhead = 5'000'000'000;
  FakeServer server([](Peer& peer) {
    EXPECT_TRUE(peer.read().has_hello());
    peer.send(welcome());
    for (int i = 0; i < 2; ++i) {
      const auto ping = peer.read();
      if (!ping.has_ping()) return;
      wire::Envelope pong;
      pong.mutable_pong()->set_time_us(ping.ping().time_us());
      pong.mutable_pong()->set_server_time_us(now_us() + kAhead);
      peer.send(pong);
    }
    wire::Envelope answer;
    answer.mutable_no_change()->set_answers(1);
    peer.send(answer);
    EXPECT_TRUE(peer.read().has_goodbye());
  });
  auto options = to(server.port);
  options.measure_clock = true;
  auto connection = Connection::open(options);
  ASSERT_TRUE(connection) << connection.error().message;
  const auto message = (*connection)->next(10s);
  ASSERT_TRUE(message && *message);
  const auto ahead = (*connection)->server_clock_ahead();
  ASSERT_TRUE(ahead);
  EXPECT_NEAR(static_cast<double>(*ahead - kAhead), 0.0, 1e6);  // half of the longest that a ping may take here
}

TEST(Connection, APrivateLayerLargerThanAskedForIsRefused) {
  FakeServer server([](Peer& peer) {
    EXPECT_EQ(peer.read().hello().max_view_phystex(), 512u);
    auto e = welcome();
    e.mutable_welcome()->set_view_phystex(1024);
    peer.send(e);
  });
  auto options = to(server.port);
  options.max_view_phystex = 512;
  const auto connection = Connection::open(options);
  ASSERT_FALSE(connection);
  EXPECT_NE(connection.error().message.find("private layer"), std::string::npos);
}

TEST(Connection, CamerasGoByAuthenticatedDatagramWhereOffered) {
  const int udp = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::bind(udp, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  socklen_t size = sizeof(address);
  ::getsockname(udp, reinterpret_cast<sockaddr*>(&address), &size);
  const std::uint32_t udp_port = ntohs(address.sin_port);
  FakeServer server([udp_port](Peer& peer) {
    peer.read();
    peer.send(welcome(udp_port));
    peer.read();
  });
  auto connection = Connection::open(to(server.port));
  ASSERT_TRUE(connection) << connection.error().message;
  ASSERT_TRUE((*connection)->uses_udp());
  proto::DatagramGate gate(*proto::datagram_key(std::string(32, 'k')), 77);
  for (std::uint64_t i = 1; i <= 3; ++i) {
    ASSERT_TRUE((*connection)->send_camera(look_at({0, 0, 0}, {1, 0, 0}, 60, 64, 64)));
    std::uint8_t buffer[2048];
    const auto n = ::recv(udp, buffer, sizeof(buffer), 0);
    ASSERT_GT(n, 0);
    wire::DatagramBody body;
    ASSERT_TRUE(gate.open(std::span(buffer, static_cast<std::size_t>(n)), body));
    EXPECT_EQ(body.camera().sequence(), i);
  }
  ::close(udp);
}

TEST(Connection, GoodbyeOfTheServerIsTheError) {
  FakeServer server([](Peer& peer) {
    peer.read();
    wire::Envelope e;
    e.mutable_goodbye()->set_reason(wire::Goodbye::SERVER_FULL);
    e.mutable_goodbye()->set_text("64 of 64 sessions\nin use");
    peer.send(e);
  });
  const auto connection = Connection::open(to(server.port));
  ASSERT_FALSE(connection);
  EXPECT_NE(connection.error().message.find("SERVER_FULL"), std::string::npos) << connection.error().message;
  EXPECT_EQ(connection.error().message.find('\n'), std::string::npos);
  EXPECT_EQ(connection.error().cause, Cause::kFull);
}

TEST(Connection, NamesTheSceneItHasAndCanBeStoppedWhileItWaits) {
  FakeServer server([](Peer& peer) {
    EXPECT_EQ(peer.read().hello().known_scene(), 0x1234567890abcdefu);
    peer.read();  // says nothing, until the client goes
  });
  auto options = to(server.port);
  options.known_scene = 0x1234567890abcdefu;
  options.handshake_timeout = 60s;
  std::stop_source stop;
  options.stop = stop.get_token();
  std::thread impatient([&] {
    std::this_thread::sleep_for(100ms);
    stop.request_stop();
  });
  const auto begin = Clock::now();
  EXPECT_FALSE(Connection::open(options));
  EXPECT_LT(Clock::now() - begin, 10s);
  impatient.join();
}

TEST(Connection, HostileLengthsAndGarbageEndIt) {
  for (const std::vector<std::uint8_t>& bytes : {std::vector<std::uint8_t>{0xff, 0xff, 0xff, 0xff},
                                                 std::vector<std::uint8_t>{0, 0, 0, 4, 0xff, 0xff, 0xff, 0xff}}) {
    FakeServer server([&](Peer& peer) {
      peer.read();
      peer.send_bytes(bytes);
    });
    EXPECT_FALSE(Connection::open(to(server.port)));
  }
}

TEST(Connection, VersionsAreRefusedAndSilenceEnds) {
  {
    FakeServer server([](Peer& peer) {
      peer.read();
      auto e = welcome();
      e.mutable_welcome()->set_version(9);
      peer.send(e);
      peer.read();
    });
    EXPECT_FALSE(Connection::open(to(server.port)));
  }
  FakeServer server([](Peer& peer) {
    peer.read();
    peer.read();
  });
  auto options = to(server.port);
  options.handshake_timeout = 100ms;
  EXPECT_FALSE(Connection::open(options));
}

TEST(Connection, AddressesAreParsed) {
  std::string host;
  std::uint16_t port = 0;
  ASSERT_TRUE(parse_address("[::1]:70", host, port));
  EXPECT_EQ(host, "::1");
  EXPECT_EQ(port, 70);
  for (const char* bad : {"", "host", ":5", "host:", "host:0", "host:70000", "host:5x"})
    EXPECT_FALSE(parse_address(bad, host, port)) << bad;
}

}  // namespace
}  // namespace darm::client
