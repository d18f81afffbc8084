// Browsers' side of the web port over real sockets: HTTP, HTTPS and the stream.
#include <gtest/gtest.h>

#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <filesystem>
#include <vector>

#include "actors/runtime/threaded_system.hpp"
#include "actors/session/tcp_listener.hpp"
#include "actors/session/tls_context.hpp"
#include "actors/session/web_listener.hpp"
#include "proto/darm.pb.h"
#include "proto/framing.hpp"
#include "proto/limits.hpp"
#include "tests/integration/session/session_world.hpp"

namespace darm::session {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;

const std::array<std::uint8_t, 5> kPage{'<', 'p', 'a', 'g', 'e'};
const std::array<WebFile, 1> kFiles{WebFile{"/index.html", "text/html", "tag", false, kPage, {}, {}}};

class WebTest : public SessionWorld {
 protected:
  WebTest() {
    std::string name = ::testing::TempDir() + "darm-web-XXXXXX";
    folder = ::mkdtemp(name.data());
    const auto tls = make_tls_context(self_signed_in(folder, {}).value()).value();
    WebListenerOptions options;
    options.address = "127.0.0.1";
    options.max_sessions = 2;
    options.max_pending = 16;  // of which one address has half
    options.files = kFiles;
    options.tls = tls;
    web = WebListener::open(io, system, around, options).value();
    options.tls = nullptr;
    without_tls = WebListener::open(io, system, around, options).value();
    TcpListenerOptions tcp_options;
    tcp_options.address = "127.0.0.1";
    tcp_options.tls = tls;
    bare = TcpListener::open(io, system, around, tcp_options).value();
    run();
  }
  ~WebTest() override {
    web->stop();
    without_tls->stop();
    bare->stop();
    finish();
    std::filesystem::remove_all(folder);
  }

  tcp::socket connect(std::uint16_t port) {
    tcp::socket socket(client_io);
    socket.connect(tcp::endpoint(asio::ip::address_v4::loopback(), port));
    give_up_after_ten_seconds(socket);
    return socket;
  }
  // What comes back for `text`, until the server closes or the whole reply is there.
  template <class Stream>
  http::response<http::string_body> ask(Stream& stream, const std::string& text, bool head = false) {
    asio::write(stream, asio::buffer(text));
    http::response_parser<http::string_body> parser;
    parser.skip(head);
    beast::error_code ec;
    http::read(stream, buffer, parser, ec);
    EXPECT_FALSE(ec) << ec.message() << " for " << text.substr(0, 60);
    return parser.release();
  }
  http::response<http::string_body> ask_once(const std::string& text, bool head = false) {
    return ask_once(*web, text, head);
  }
  http::response<http::string_body> ask_once(WebListener& listener, const std::string& text, bool head = false) {
    auto socket = connect(listener.port());
    buffer.clear();
    return ask(socket, text, head);
  }
  bool ask_works() {
    auto socket = connect(web->port());
    beast::error_code ec;
    buffer.clear();
    asio::write(socket, asio::buffer(std::string("GET / HTTP/1.1\r\nHost: a\r\n\r\n")), ec);
    http::response<http::string_body> reply;
    http::read(socket, buffer, reply, ec);
    return !ec && reply.body() == "<page";
  }
  template <class Stream>
  void join(websocket::stream<Stream>& socket, const std::string& origin = {}) {
    socket.set_option(websocket::stream_base::decorator([origin](websocket::request_type& request) {
      request.set(http::field::sec_websocket_protocol, "darm.2");
      if (!origin.empty()) request.set(http::field::origin, origin);
    }));
    socket.binary(true);
    socket.handshake("localhost:1", "/stream");
  }
  template <class Stream>
  static void say(Stream& socket, const wire::Envelope& e) {
    socket.write(asio::buffer(e.SerializeAsString()));
  }
  // The next message that is no ping; nothing at the end.
  template <class Stream>
  std::optional<wire::Envelope> hear(Stream& socket) {
    for (;;) {
      beast::flat_buffer message;
      beast::error_code ec;
      socket.read(message, ec);
      wire::Envelope e;
      if (ec || !socket.got_binary() || !e.ParseFromArray(message.data().data(), static_cast<int>(message.size())))
        return std::nullopt;
      if (!e.has_ping()) return e;
      wire::Envelope pong;
      pong.mutable_pong()->set_time_us(e.ping().time_us());
      socket.write(asio::buffer(pong.SerializeAsString()), ec);
    }
  }
  template <class Stream>
  std::optional<wire::Welcome> enter(websocket::stream<Stream>& socket) {
    join(socket);
    say(socket, hello());
    const auto first = hear(socket);
    const auto manifest = hear(socket);
    if (!first || !first->has_welcome() || !manifest || !manifest->has_manifest()) return std::nullopt;
    for (std::uint32_t i = 0; i < manifest->manifest().geometry_chunks(); ++i) {
      const auto chunk = hear(socket);
      if (!chunk || !chunk->has_geometry()) return std::nullopt;
    }
    return first->welcome();
  }

  std::filesystem::path folder;
  asio::io_context client_io;
  beast::flat_buffer buffer;
  std::unique_ptr<WebListener> web, without_tls;
  std::unique_ptr<TcpListener> bare;
};

TEST_F(WebTest, the_page_comes_over_http_and_https_on_one_port_and_connections_are_kept) {
  auto plain = connect(web->port());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(ask(plain, "GET / HTTP/1.1\r\nHost: a\r\n\r\n").body(), "<page");
  asio::ssl::context trusting(asio::ssl::context::tls_client);
  trusting.set_verify_mode(asio::ssl::verify_peer);
  trusting.load_verify_file((folder / "certificate.pem").string());
  asio::ssl::stream<tcp::socket> secure(connect(web->port()), trusting);
  secure.set_verify_callback(asio::ssl::host_name_verification("localhost"));
  secure.handshake(asio::ssl::stream_base::client);
  buffer.clear();
  for (int i = 0; i < 3; ++i) EXPECT_EQ(ask(secure, "GET / HTTP/1.1\r\nHost: a\r\n\r\n").body(), "<page");
}

TEST_F(WebTest, head_names_the_length_and_sends_nothing) {
  const auto reply = ask_once("HEAD / HTTP/1.1\r\nHost: a\r\n\r\n", true);
  EXPECT_EQ(reply.result_int(), 200u);
  EXPECT_EQ(reply[http::field::content_length], "5");
}

TEST_F(WebTest, health_counts_the_sessions) {
  websocket::stream<tcp::socket> socket(connect(web->port()));
  ASSERT_TRUE(enter(socket));
  EXPECT_NE(ask_once("GET /healthz HTTP/1.1\r\nHost: a\r\n\r\n").body().find("\"sessions\":1,\"max_sessions\":2"),
            std::string::npos);
}

TEST_F(WebTest, health_says_whether_there_is_https_and_where) {
  const std::string request = "GET /healthz HTTP/1.1\r\nHost: a\r\n\r\n";
  const auto with = ask_once(request).body(), without = ask_once(*without_tls, request).body();
  EXPECT_NE(with.find("\"https_port\":" + std::to_string(web->port()) + "}"), std::string::npos) << with;
  EXPECT_NE(without.find("\"https_port\":0}"), std::string::npos) << without;
}

TEST_F(WebTest, rude_requests_hear_why) {
  EXPECT_EQ(ask_once("BREW / HTTP/1.1\r\nHost: a\r\n\r\n").result_int(), 405u);
  EXPECT_EQ(ask_once("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 999999999999\r\n\r\n").result_int(), 413u);
  EXPECT_EQ(ask_once("GET / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\nhello").result_int(), 413u);
  EXPECT_EQ(ask_once("GET / HTTP/1.1\r\nX: " + std::string(9000, 'x') + "\r\n\r\n").result_int(), 431u);
  EXPECT_EQ(ask_once("what is this\r\n\r\n").result_int(), 400u);
  EXPECT_EQ(ask_once("GET /../../etc/passwd HTTP/1.1\r\nHost: a\r\n\r\n").result_int(), 404u);
}

TEST_F(WebTest, a_stream_is_a_session_one_message_an_envelope) {
  websocket::stream<tcp::socket> socket(connect(web->port()));
  const auto welcome = enter(socket);
  ASSERT_TRUE(welcome);
  auto frame = std::make_shared<EncodedFrame>();
  frame->frame = 1;
  frame->key = true;
  frame->h264.assign(3'000'000, 7);
  around->sessions->find(SessionId{welcome->session()}).tell(FrameEncoded(frame, {}));
  const auto got = hear(socket);
  ASSERT_TRUE(got && got->has_frame());
  EXPECT_EQ(got->frame().h264().size(), 3'000'000u);
  wire::Envelope e;
  e.mutable_camera()->set_sequence(7);
  put_pose(Camera{}, Viewport{}, *e.mutable_camera()->mutable_pose());
  say(socket, e);
  EXPECT_TRUE(eventually([&] { return seen.newest_view == 7; }));
  wire::Envelope bye;
  bye.mutable_goodbye()->set_reason(wire::Goodbye::CLIENT_LEAVES);
  say(socket, bye);
  EXPECT_FALSE(hear(socket)) << "the server closes";
  EXPECT_TRUE(eventually([&] { return seen.closed == 1; }));
}

TEST_F(WebTest, the_same_under_tls) {
  asio::ssl::context any(asio::ssl::context::tls_client);
  websocket::stream<beast::ssl_stream<tcp::socket>> socket(connect(web->port()), any);
  socket.next_layer().handshake(asio::ssl::stream_base::client);
  const auto welcome = enter(socket);
  ASSERT_TRUE(welcome);
  auto frame = std::make_shared<EncodedFrame>();
  frame->frame = 1;
  frame->key = true;
  frame->h264.assign(1'000'000, 7);
  around->sessions->find(SessionId{welcome->session()}).tell(FrameEncoded(frame, {}));
  const auto got = hear(socket);
  ASSERT_TRUE(got && got->has_frame());
  EXPECT_EQ(got->frame().h264().size(), 1'000'000u);
}

TEST_F(WebTest, a_client_that_does_not_read_gets_no_more_than_its_queue) {
  websocket::stream<tcp::socket> socket(connect(web->port()));
  const auto welcome = enter(socket);
  ASSERT_TRUE(welcome);
  const auto ref = around->sessions->find(SessionId{welcome->session()});
  std::weak_ptr<EncodedFrame> some;
  for (FrameNumber n = 1; n <= 60; ++n) {
    auto frame = std::make_shared<EncodedFrame>();
    frame->frame = n;
    frame->key = true;
    frame->h264.assign(2'000'000, 7);
    if (n == 30) some = frame;
    ref.tell(FrameEncoded(std::move(frame), {}));
  }
  EXPECT_TRUE(eventually([&] { return some.expired(); })) << "pictures that could not be sent are let go of";
  FrameNumber newest = 0;
  while (newest < 60) {
    const auto got = hear(socket);
    ASSERT_TRUE(got && got->has_frame());
    newest = got->frame().frame();
  }
}

TEST_F(WebTest, pages_of_others_may_not_open_a_stream) {
  websocket::stream<tcp::socket> socket(connect(web->port()));
  EXPECT_THROW(join(socket, "https://evil.example"), beast::system_error);
  websocket::stream<tcp::socket> own(connect(web->port()));
  EXPECT_NO_THROW(join(own, "https://localhost:1"));
}

TEST_F(WebTest, only_the_subprotocol_of_this_version_is_spoken) {
  websocket::stream<tcp::socket> none(connect(web->port()));
  EXPECT_THROW(none.handshake("localhost", "/stream"), beast::system_error);
  websocket::stream<tcp::socket> elsewhere(connect(web->port()));
  EXPECT_THROW(elsewhere.handshake("localhost", "/other"), beast::system_error);
}

TEST_F(WebTest, messages_over_the_limit_and_text_end_the_session) {
  for (const bool text : {false, true}) {
    websocket::stream<tcp::socket> socket(connect(web->port()));
    ASSERT_TRUE(enter(socket));
    socket.text(text);
    socket.write(asio::buffer(std::string(text ? 5 : proto::kMaxClientEnvelope + 1, 'x')));
    while (hear(socket)) {
    }
    EXPECT_TRUE(eventually([&] { return around->live->load() == 0; }));
  }
}

TEST_F(WebTest, one_client_too_many_is_told_so_in_a_message) {
  websocket::stream<tcp::socket> first(connect(web->port()));
  websocket::stream<tcp::socket> second(connect(web->port()));
  ASSERT_TRUE(enter(first));
  ASSERT_TRUE(enter(second));
  websocket::stream<tcp::socket> third(connect(web->port()));
  join(third);
  const auto got = hear(third);
  ASSERT_TRUE(got && got->has_goodbye());
  EXPECT_EQ(got->goodbye().reason(), wire::Goodbye::SERVER_FULL);
  EXPECT_FALSE(hear(third));
}

TEST_F(WebTest, clients_of_an_address_count_together_by_whichever_port_they_came) {
  around->addresses = std::make_shared<AddressPlaces>(1);
  std::optional<tcp::socket> by_tcp(connect(bare->port()));
  asio::write(*by_tcp, asio::buffer(proto::frame(hello())));
  ASSERT_TRUE(eventually([&] { return around->live->load() == 1; }));
  websocket::stream<tcp::socket> by_web(connect(web->port()));
  join(by_web);
  const auto got = hear(by_web);
  ASSERT_TRUE(got && got->has_goodbye());
  EXPECT_EQ(got->goodbye().reason(), wire::Goodbye::SERVER_FULL);
  by_tcp->close();
  by_tcp.reset();
  ASSERT_TRUE(eventually([&] { return around->addresses->addresses() == 0; }));
  websocket::stream<tcp::socket> later(connect(web->port()));
  EXPECT_TRUE(enter(later));
}

TEST_F(WebTest, a_client_that_vanishes_leaves_nothing_behind) {
  {
    websocket::stream<tcp::socket> socket(connect(web->port()));
    ASSERT_TRUE(enter(socket));
    socket.next_layer().close();
  }
  EXPECT_TRUE(eventually([&] { return around->live->load() == 0 && seen.closed == 1; }));
  EXPECT_EQ(around->sessions->size(), 0u);
}

TEST_F(WebTest, more_idle_connections_than_it_may_have_are_closed) {
  std::vector<tcp::socket> silent;
  for (int i = 0; i < 8; ++i) silent.push_back(connect(web->port()));
  const auto closed_at_once = [this] {
    auto socket = connect(web->port());
    const timeval soon{0, 200'000};
    setsockopt(socket.native_handle(), SOL_SOCKET, SO_RCVTIMEO, &soon, sizeof soon);
    char byte = 0;
    return ::recv(socket.native_handle(), &byte, 1, 0) == 0;
  };
  EXPECT_TRUE(eventually(closed_at_once));
  silent.clear();
  EXPECT_TRUE(eventually([&] { return ask_works(); })) << "their places are free again";
}

TEST_F(WebTest, the_tcp_port_speaks_tls_too) {
  asio::ssl::context any(asio::ssl::context::tls_client);
  asio::ssl::stream<tcp::socket> secure(connect(bare->port()), any);
  secure.handshake(asio::ssl::stream_base::client);
  asio::write(secure, asio::buffer(proto::frame(hello())));
  std::array<std::uint8_t, 4> length{};
  asio::read(secure, asio::buffer(length));
  std::string message(length[2] * 256u + length[3], '\0');
  asio::read(secure, asio::buffer(message));
  wire::Envelope e;
  ASSERT_TRUE(e.ParseFromString(message));
  EXPECT_TRUE(e.has_welcome());
  beast::error_code ec;
  auto plain = connect(bare->port());
  asio::write(plain, asio::buffer(proto::frame(hello())));
  asio::read(plain, asio::buffer(length), ec);
  EXPECT_FALSE(ec) << "and bare TCP as before";
}

}  // namespace
}  // namespace darm::session
