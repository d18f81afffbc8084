#include "actors/session/session_actor.hpp"

#include <gtest/gtest.h>

#include "actors/runtime/deterministic_system.hpp"
#include "proto/limits.hpp"
#include "tests/unit/session/small_scene.hpp"

namespace darm::session {
namespace {

using namespace std::chrono_literals;

// A connection whose other end is the test.
class ScriptedConnection : public Connection {
 public:
  void attach(runtime::Ref<Inbox> owner) override { owner_ = std::move(owner); }
  void read() override { ++reads; }
  void write(Packets packets) override {
    ++writes;
    std::size_t bytes = 0;
    for (const auto& packet : packets) {
      reader.feed(packet.head);
      if (packet.body) reader.feed(*packet.body);
      reader.feed(packet.tail);
      bytes += packet.size();
    }
    if (accepts_writes) owner_.tell(BytesSent(bytes));
  }
  void close() override {
    closed = true;
    owner_ = {};
  }
  void say(const wire::Envelope& e) { owner_.tell(BytesReceived(proto::frame(e))); }
  void vanish() { owner_.tell(SocketClosed("reset")); }
  std::vector<wire::Envelope> heard() {
    std::vector<wire::Envelope> out;
    wire::Envelope e;
    while (reader.next(e).value())
      if (!e.has_ping()) out.push_back(e);
    return out;
  }

  proto::FrameReader reader{proto::kMaxServerEnvelope};
  int reads = 0;
  int writes = 0;
  bool accepts_writes = true;
  bool closed = false;

 private:
  runtime::Ref<Inbox> owner_;
};

class SchedulerProbe : public runtime::Actor<tile_scheduler::Inbox> {
 public:
  struct Seen {
    int opened = 0, closed = 0, views = 0, keys = 0;
  };
  SchedulerProbe(runtime::Context<tile_scheduler::Inbox> context, Seen* seen)
      : Actor(std::move(context)), seen_(seen) {}
  void on(tile_scheduler::SessionOpened&&) { ++seen_->opened; }
  void on(tile_scheduler::SessionClosed&&) { ++seen_->closed; }
  void on(tile_scheduler::ViewChanged&&) { ++seen_->views; }
  void on(tile_scheduler::KeyFrameWanted&&) { ++seen_->keys; }
  template <class M>
  void on(M&&) {}

 private:
  Seen* seen_;
};

class SessionActorTest : public ::testing::Test {
 protected:
  SessionActorTest() {
    const auto [scene, layout] = testing::grid(8);
    around->scene = GeometryStream::build(scene, layout, 1.0f, 1).value();
    around->sessions = std::make_shared<SessionRegistry>();
    around->scheduler = system.spawn<SchedulerProbe>("tile_scheduler", 64, &seen);
  }
  void open() {
    session = system.spawn<SessionActor>("session/1", 64, SessionId{1}, around, connection);
    wire::Envelope hello;
    hello.mutable_hello()->set_version(proto::kProtocolVersion);
    system.run_until_idle();
    connection->say(hello);
    system.run_until_idle();
  }
  void expect_nothing_left() {
    EXPECT_EQ(around->sessions->size(), 0u);
    EXPECT_EQ(around->datagrams->size(), 0u);
    EXPECT_EQ(around->live->load(), 0u);
    EXPECT_EQ(seen.opened, 1);
    EXPECT_EQ(seen.closed, 1);
    EXPECT_TRUE(connection->closed);
    EXPECT_FALSE(static_cast<bool>(session));
  }

  SchedulerProbe::Seen seen;
  runtime::DeterministicSystem system;
  std::shared_ptr<SessionSurroundings> around = std::make_shared<SessionSurroundings>();
  std::shared_ptr<ScriptedConnection> connection = std::make_shared<ScriptedConnection>();
  runtime::Ref<Inbox> session;
};

TEST_F(SessionActorTest, opens_and_is_found_by_its_number) {
  open();
  EXPECT_EQ(seen.opened, 1);
  EXPECT_TRUE(static_cast<bool>(around->sessions->find(SessionId{1})));
  EXPECT_EQ(around->datagrams->size(), 1u);
  EXPECT_TRUE(connection->heard().at(0).has_welcome());
  EXPECT_EQ(connection->reads, 2);  // the next piece is read only when the last is handled
}

TEST_F(SessionActorTest, the_scene_goes_out_in_few_turns) {
  const auto [scene, layout] = testing::grid(400);
  around->scene = GeometryStream::build(scene, layout, 1.0f, 1).value();
  open();
  const auto chunks = around->scene->chunk_count();
  ASSERT_GE(chunks, 30u);
  EXPECT_EQ(connection->heard().size(), chunks + 2);
  const auto bytes = around->scene->total_bytes();
  EXPECT_LE(static_cast<std::size_t>(connection->writes), bytes / (SendLimits{}.write_bytes / 2) + 2) << bytes;
}

TEST_F(SessionActorTest, a_client_that_vanishes_leaves_nothing_behind) {
  open();
  connection->vanish();
  system.run_until_idle();
  system.advance(60s);
  expect_nothing_left();
}

TEST_F(SessionActorTest, a_client_that_falls_silent_leaves_nothing_behind) {
  open();
  system.advance(40s);
  EXPECT_EQ(connection->heard().back().goodbye().reason(), wire::Goodbye::TIMED_OUT);
  expect_nothing_left();
}

TEST_F(SessionActorTest, a_client_that_does_not_read_leaves_nothing_behind) {
  connection->accepts_writes = false;
  open();
  wire::Envelope ping;
  ping.mutable_ping();
  for (int i = 0; i < 4; ++i) {
    connection->say(ping);
    system.advance(6s);
  }
  expect_nothing_left();
}

TEST_F(SessionActorTest, a_stopped_session_leaves_nothing_behind) {
  open();
  system.stop(session);
  system.run_until_idle();
  expect_nothing_left();
}

TEST_F(SessionActorTest, says_goodbye_when_the_server_stops) {
  open();
  session.tell(CloseSession(wire::Goodbye::SERVER_STOPS));
  system.run_until_idle();
  EXPECT_EQ(connection->heard().back().goodbye().reason(), wire::Goodbye::SERVER_STOPS);
  expect_nothing_left();
}

TEST_F(SessionActorTest, garbage_ends_one_session_and_no_more) {
  open();
  session.tell(BytesReceived(Bytes(100, 0xff)));
  system.run_until_idle();
  EXPECT_EQ(connection->heard().back().goodbye().reason(), wire::Goodbye::PROTOCOL_ERROR);
  expect_nothing_left();
  EXPECT_TRUE(system.failures().empty());
}

}  // namespace
}  // namespace darm::session
