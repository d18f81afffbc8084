// A scripted client over real sockets on the loopback device.
#include <gtest/gtest.h>

#include <boost/asio.hpp>
#include <thread>

#include "actors/session/tcp_listener.hpp"
#include "actors/session/udp_listener.hpp"
#include "proto/limits.hpp"
#include "tests/integration/session/session_world.hpp"

namespace darm::session {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;

// Blocking client; every read gives up after ten seconds.
class Client {
 public:
  explicit Client(std::uint16_t port) : socket_(io_) {
    socket_.connect(tcp::endpoint(asio::ip::address_v4::loopback(), port));
    const timeval limit{10, 0};
    setsockopt(socket_.native_handle(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  }
  void say(const wire::Envelope& e) { asio::write(socket_, asio::buffer(proto::frame(e))); }
  /// The next message that is no ping; nothing at the end of the stream.
  std::optional<wire::Envelope> hear() {
    while (auto e = hear_any()) {
      if (!e->has_ping()) return e;
      wire::Envelope pong;
      pong.mutable_pong()->set_time_us(e->ping().time_us());
      say(pong);
    }
    return std::nullopt;
  }
  std::optional<wire::Envelope> hear_any() {
    wire::Envelope e;
    std::array<std::uint8_t, 4096> piece{};
    while (!reader_.next(e).value()) {
      // recv itself: Asio would wait on past the time-out.
      const auto n = ::recv(socket_.native_handle(), piece.data(), piece.size(), 0);
      if (n <= 0) return std::nullopt;
      reader_.feed(std::span(piece).first(static_cast<std::size_t>(n)));
    }
    return e;
  }
  void vanish() { socket_.close(); }

 private:
  asio::io_context io_;
  tcp::socket socket_;
  proto::FrameReader reader_{proto::kMaxServerEnvelope};
};

class LoopbackTest : public SessionWorld {
 protected:
  LoopbackTest() {
    udp_listener = UdpListener::open(io, around, "127.0.0.1", 0).value();
    TcpListenerOptions options;
    options.address = "127.0.0.1";
    options.max_sessions = 2;
    listener = TcpListener::open(io, system, around, options).value();
    run();
  }
  ~LoopbackTest() override {
    listener->stop();
    udp_listener->stop();
    finish();
  }
  std::optional<wire::Welcome> join(Client& client) {
    client.say(hello());
    const auto first = client.hear();
    if (!first || !first->has_welcome()) return std::nullopt;
    const auto manifest = client.hear();
    if (!manifest || !manifest->has_manifest()) return std::nullopt;
    for (std::uint32_t i = 0; i < manifest->manifest().geometry_chunks(); ++i) {
      const auto chunk = client.hear();
      if (!chunk || !chunk->has_geometry()) return std::nullopt;
    }
    return first->welcome();
  }

  std::unique_ptr<UdpListener> udp_listener;
  std::unique_ptr<TcpListener> listener;
};

TEST_F(LoopbackTest, a_client_joins_hears_pictures_and_leaves) {
  Client client(listener->port());
  const auto welcome = join(client);
  ASSERT_TRUE(welcome.has_value());
  EXPECT_EQ(welcome->udp_port(), udp_listener->port());
  auto frame = std::make_shared<EncodedFrame>();
  frame->frame = 1;
  frame->key = true;
  frame->h264.assign(3'000'000, 7);
  around->sessions->find(SessionId{welcome->session()}).tell(FrameEncoded(frame, {}));
  const auto got = client.hear();
  ASSERT_TRUE(got && got->has_frame());
  EXPECT_EQ(got->frame().h264().size(), 3'000'000u);
  wire::Envelope bye;
  bye.mutable_goodbye()->set_reason(wire::Goodbye::CLIENT_LEAVES);
  client.say(bye);
  EXPECT_FALSE(client.hear().has_value());
  EXPECT_TRUE(eventually([&] { return seen.closed == 1; }));
}

TEST_F(LoopbackTest, a_client_that_vanishes_leaves_nothing_behind) {
  {
    Client client(listener->port());
    ASSERT_TRUE(join(client).has_value());
    client.vanish();
  }
  EXPECT_TRUE(eventually([&] { return around->live->load() == 0; }));
  EXPECT_EQ(around->sessions->size(), 0u);
  EXPECT_EQ(around->datagrams->size(), 0u);
  EXPECT_TRUE(eventually([&] { return seen.closed == 1; }));
  EXPECT_EQ(seen.opened, 1);
}

TEST_F(LoopbackTest, cameras_come_by_udp_and_forgeries_do_not) {
  Client client(listener->port());
  const auto welcome = join(client);
  ASSERT_TRUE(welcome.has_value());
  const auto key = *proto::datagram_key(welcome->key());
  wire::DatagramBody body;
  put_pose(Camera{}, Viewport{}, *body.mutable_camera()->mutable_pose());
  asio::io_context local;
  udp::socket socket(local, udp::v4());
  const udp::endpoint to(asio::ip::address_v4::loopback(), udp_listener->port());
  const auto send = [&](const proto::SipKey& with, std::uint64_t sequence, std::uint64_t camera) {
    body.mutable_camera()->set_sequence(camera);
    socket.send_to(asio::buffer(proto::seal_datagram(with, welcome->session(), sequence, body)), to);
  };
  send(proto::SipKey{}, 1, 50);  // forged
  socket.send_to(asio::buffer(std::string(1300, 'x')), to);
  send(key, 1, 2);
  EXPECT_TRUE(eventually([&] { return seen.newest_view == 2; }));
  send(key, 1, 60);  // replayed sequence
  send(key, 2, 3);
  EXPECT_TRUE(eventually([&] { return seen.newest_view == 3; }));
}

TEST_F(LoopbackTest, one_client_too_many_is_told_so) {
  Client first(listener->port());
  Client second(listener->port());
  ASSERT_TRUE(join(first).has_value());
  ASSERT_TRUE(join(second).has_value());
  Client third(listener->port());
  third.say(hello());
  const auto got = third.hear();
  ASSERT_TRUE(got && got->has_goodbye());
  EXPECT_EQ(got->goodbye().reason(), wire::Goodbye::SERVER_FULL);
  EXPECT_FALSE(third.hear().has_value());
}

TEST_F(LoopbackTest, one_client_too_many_of_an_address_is_told_so) {
  around->addresses = std::make_shared<AddressPlaces>(1);
  std::optional<Client> first(listener->port());
  ASSERT_TRUE(join(*first).has_value());
  Client second(listener->port());
  const auto got = second.hear();
  ASSERT_TRUE(got && got->has_goodbye());
  EXPECT_EQ(got->goodbye().reason(), wire::Goodbye::SERVER_FULL);
  EXPECT_NE(got->goodbye().text().find("this address"), std::string::npos) << got->goodbye().text();
  EXPECT_FALSE(second.hear().has_value());
  first.reset();
  EXPECT_TRUE(eventually([&] { return around->addresses->addresses() == 0; }));
  Client third(listener->port());
  EXPECT_TRUE(join(third).has_value()) << "the place is free again";
}

TEST_F(LoopbackTest, a_client_is_turned_away_while_the_others_hold_as_much_as_they_may) {
  around->policy.memory = std::make_shared<SessionMemory>(1000);
  {
    SessionMemory::Share others(around->policy.memory);
    others.set(1001);
    Client client(listener->port());
    const auto got = client.hear();
    ASSERT_TRUE(got && got->has_goodbye());
    EXPECT_EQ(got->goodbye().reason(), wire::Goodbye::SERVER_FULL);
  }
  Client client(listener->port());
  EXPECT_TRUE(join(client).has_value());
}

TEST_F(LoopbackTest, a_version_that_is_not_spoken_is_refused_in_words) {
  Client client(listener->port());
  auto e = hello();
  e.mutable_hello()->set_version(9);
  client.say(e);
  const auto got = client.hear();
  ASSERT_TRUE(got && got->has_goodbye());
  EXPECT_EQ(got->goodbye().reason(), wire::Goodbye::VERSION_UNSUPPORTED);
}

TEST_F(LoopbackTest, a_taken_port_is_an_error_with_a_way_out) {
  TcpListenerOptions options;
  options.address = "127.0.0.1";
  options.port = udp_listener->port();
  const auto once = TcpListener::open(io, system, around, options);
  const auto twice = TcpListener::open(io, system, around, options);
  ASSERT_FALSE(twice.has_value());
  EXPECT_NE(twice.error().message.find("choose another port"), std::string::npos);
  options.address = "not an address";
  EXPECT_FALSE(TcpListener::open(io, system, around, options).has_value());
}

}  // namespace
}  // namespace darm::session
