// The stream's thread against a server that follows a script, on the loopback.
#include "client/desktop/live_stream.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <span>
#include <thread>

#include "proto/framing.hpp"
#include "proto/limits.hpp"
#include "tests/unit/client/peer.hpp"
#include "tests/unit/client/synthetic.hpp"

namespace darm::client::desktop {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kTag = 4711;

/// Visits 0, 1, ... are each given to the script, one after the other.
class ScriptedServer {
 public:
  explicit ScriptedServer(std::function<void(unsigned, Peer&)> script) {
    listener_ = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    EXPECT_EQ(::listen(listener_, 4), 0);
    socklen_t size = sizeof(address);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::jthread([this, script = std::move(script)](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        pollfd ready{listener_, POLLIN, 0};
        if (::poll(&ready, 1, 20) <= 0) continue;
        Peer peer(::accept(listener_, nullptr, nullptr));
        script(visits++, peer);
      }
    });
  }
  ~ScriptedServer() {
    thread_.request_stop();
    thread_.join();
    ::close(listener_);
  }
  ScriptedServer(const ScriptedServer&) = delete;
  ScriptedServer& operator=(const ScriptedServer&) = delete;

  [[nodiscard]] ConnectOptions address() const {
    ConnectOptions o;
    o.host = "127.0.0.1";
    o.port = port_;
    return o;
  }

  std::atomic<unsigned> visits = 0;

 private:
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::jthread thread_;
};

wire::Envelope welcome(bool known = false) {
  wire::Envelope e;
  auto& w = *e.mutable_welcome();
  w.set_version(proto::kProtocolVersion);
  w.set_session(77);
  w.set_key(std::string(proto::kSessionKeyBytes, 'k'));
  w.set_phystex_size(1024);
  w.set_updates_per_second(30);
  w.set_scene_known(known);
  return e;
}

wire::Envelope goodbye(wire::Goodbye::Reason reason, const std::string& text) {
  wire::Envelope e;
  e.mutable_goodbye()->set_reason(reason);
  e.mutable_goodbye()->set_text(text);
  return e;
}

void send_scene(Peer& peer) {
  wire::Envelope manifest, chunk;
  *manifest.mutable_manifest() = synthetic::manifest();
  manifest.mutable_manifest()->set_tag(kTag);
  manifest.mutable_manifest()->set_name("square");
  peer.send(manifest);
  *chunk.mutable_geometry() = synthetic::square_chunk();
  peer.send(chunk);
}

View view_at(double x) { return look_at({x, 0, 5}, {x, 0, 0}, 60, 64, 64); }

double now() { return static_cast<double>(now_us()) / 1000; }

template <class Holds>
bool comes(Holds&& holds, std::chrono::seconds within = 30s) {
  const auto end = Clock::now() + within;
  while (!holds()) {
    if (Clock::now() > end) return false;
    std::this_thread::sleep_for(2ms);
  }
  return true;
}

TEST(LiveStream, JoinsBringsTheSceneAndSendsTheNewestCamera) {
  std::atomic<double> looked = 0;
  std::atomic<int> woken = 0;
  ScriptedServer server([&](unsigned, Peer& peer) {
    const auto hello = peer.read();
    EXPECT_TRUE(hello.has_hello());
    EXPECT_EQ(hello.hello().known_scene(), 0u);
    peer.send(welcome());
    send_scene(peer);
    for (auto c = peer.camera(); c.sequence() > 0; c = peer.camera()) looked = c.pose().position().x();
  });
  LiveStream stream(server.address(), [&] { ++woken; });
  stream.look(view_at(1));
  stream.look(view_at(2));
  Arrivals all;
  ASSERT_TRUE(comes([&] {
    Arrivals a = stream.take();
    if (a.joined) all.joined = a.joined;
    if (a.scene) {
      all.scene = std::move(a.scene);
      all.scene_name = a.scene_name;
    }
    for (Chunk& c : a.chunks) all.chunks.push_back(std::move(c));
    return all.joined && all.scene && !all.chunks.empty();
  }));
  EXPECT_EQ(all.joined->shape.phystex_size, 1024u);
  EXPECT_EQ(all.scene_name, "square");
  EXPECT_TRUE(stream.connected());
  EXPECT_EQ(stream.joins(), 1u);
  EXPECT_GT(woken, 0);
  EXPECT_TRUE(comes([&] { return looked == 2; }));
  EXPECT_GT(stream.traffic().received, 0u);
  EXPECT_EQ(stream.words(now()).quiet, "Walking in...");
  stream.pictured();
  EXPECT_EQ(stream.words(now()).quiet, "");
}

TEST(LiveStream, ComesBackAfterALossWithTheSceneItHasAndWhereTheVisitorIsNow) {
  std::atomic<bool> cut = false, told = false, again = false;
  ScriptedServer server([&](unsigned visit, Peer& peer) {
    const auto hello = peer.read().hello();
    if (visit == 0) {
      peer.send(welcome());
      send_scene(peer);
      comes([&] { return cut.load(); });
      return;  // without a goodbye
    }
    EXPECT_EQ(hello.known_scene(), kTag);
    EXPECT_EQ(hello.pose().position().x(), 7);
    comes([&] { return told.load(); });
    peer.send(welcome(true));
    again = peer.camera().pose().position().x() == 7;
    peer.hold_until_gone();
  });
  LiveStream stream(server.address(), [] {});
  std::size_t chunks = 0;
  ASSERT_TRUE(comes([&] { return (chunks += stream.take().chunks.size()) == 1; }));
  stream.look(view_at(7));
  cut = true;
  ASSERT_TRUE(comes([&] { return !stream.connected(); }));
  EXPECT_NE(stream.words(now()).quiet.find("Trying again"), std::string::npos);
  EXPECT_EQ(stream.words(now()).alert, "");
  told = true;
  ASSERT_TRUE(comes([&] { return stream.connected() && again.load(); }));
  EXPECT_EQ(stream.joins(), 2u);
  Arrivals a = stream.take();
  EXPECT_TRUE(a.joined);
  EXPECT_FALSE(a.scene) << "it is here";
}

TEST(LiveStream, LetsItsSessionGoWhileNobodyLooksAndIsBackWithoutAWordOrTheSceneAgain) {
  std::atomic<bool> left = false;
  ScriptedServer server([&](unsigned visit, Peer& peer) {
    const auto hello = peer.read().hello();
    peer.send(welcome(visit > 0));
    if (visit > 0) {
      EXPECT_EQ(hello.known_scene(), kTag);
    } else {
      send_scene(peer);
    }
    peer.hold_until_gone();
    left = true;
  });
  LiveStream stream(server.address(), [] {});
  std::size_t chunks = 0;
  ASSERT_TRUE(comes([&] { return (chunks += stream.take().chunks.size()) == 1; }));
  stream.pictured();
  stream.leave();
  ASSERT_TRUE(comes([&] { return left.load() && !stream.connected(); }));
  std::this_thread::sleep_for(700ms);  // longer than until the first try after a loss
  EXPECT_EQ(server.visits, 1u) << "nobody asked for another";
  EXPECT_EQ(stream.words(now()).quiet, "");
  stream.come_back();
  ASSERT_TRUE(comes([&] { return stream.joins() == 2; }));
  EXPECT_EQ(stream.words(now()).quiet, "");
}

TEST(LiveStream, TriesAgainEverMoreSeldomWhileNobodyAnswers) {
  std::array<Clock::time_point, 5> came;
  ScriptedServer server([&](unsigned visit, Peer& peer) {
    if (visit < came.size()) came[visit] = Clock::now();
    peer.read();
  });
  LiveStream stream(server.address(), [] {});
  ASSERT_TRUE(comes([&] { return server.visits > came.size(); }));
  EXPECT_GT(came[4] - came[3], 1s) << "the first waits a third of one";
  EXPECT_EQ(stream.joins(), 0u);
}

TEST(LiveStream, SaysThatAServerIsFullAndDoesNotPressIt) {
  ScriptedServer server([](unsigned, Peer& peer) {
    peer.read();
    peer.send(goodbye(wire::Goodbye::SERVER_FULL, "full"));
  });
  LiveStream stream(server.address(), [] {});
  ASSERT_TRUE(comes([&] { return !stream.words(now()).alert.empty(); }));
  EXPECT_NE(stream.words(now()).alert.find("as many visitors"), std::string::npos);
  std::this_thread::sleep_for(1s);
  EXPECT_EQ(server.visits, 1u);
}

TEST(LiveStream, EndsForGoodWithAServerThatContradictsItself) {
  const std::function<void(Peer&)> faults[] = {
      [](Peer& peer) {
        wire::Envelope e;
        e.mutable_frame()->set_frame(1);
        e.mutable_frame()->set_key(true);
        peer.send(e);
      },
      [](Peer& peer) {
        wire::Envelope e;
        e.mutable_coarse()->set_width(4);
        peer.send(e);
      },
      [](Peer& peer) {
        wire::Envelope e;
        e.mutable_manifest()->set_q(-1);
        peer.send(e);
      },
      [](Peer& peer) {
        wire::Envelope e;
        *e.mutable_geometry() = synthetic::square_chunk();
        peer.send(e);
      },
  };
  for (const auto& fault : faults) {
    ScriptedServer server([&](unsigned, Peer& peer) {
      peer.read();
      peer.send(welcome());
      fault(peer);
      peer.hold_until_gone();
    });
    LiveStream stream(server.address(), [] {});
    ASSERT_TRUE(comes([&] { return !stream.words(now()).alert.empty(); }));
    EXPECT_NE(stream.words(now()).alert.find("contradicts itself"), std::string::npos) << stream.words(now()).alert;
    EXPECT_FALSE(stream.connected());
    std::this_thread::sleep_for(600ms);
    EXPECT_EQ(server.visits, 1u) << "a first retry would have come";
  }
}

TEST(LiveStream, RefusesASceneTakenForKnownThatItNeverHad) {
  ScriptedServer server([](unsigned, Peer& peer) {
    peer.read();
    peer.send(welcome(true));
    peer.hold_until_gone();
  });
  LiveStream stream(server.address(), [] {});
  ASSERT_TRUE(comes([&] { return !stream.words(now()).alert.empty(); }));
  EXPECT_EQ(stream.joins(), 0u);
}

TEST(LiveStream, EndsAtOnceWhateverItWaitsFor) {
  const auto seconds_to_end = [](std::function<void(unsigned, Peer&)> script, auto&& ready) {
    ScriptedServer server(std::move(script));
    auto stream = std::make_unique<LiveStream>(server.address(), [] {});
    EXPECT_TRUE(comes([&] { return ready(server, *stream); }));
    const auto begun = Clock::now();
    stream.reset();
    return std::chrono::duration<double>(Clock::now() - begun).count();
  };
  const auto visited = [](ScriptedServer& server, LiveStream&) { return server.visits > 0; };
  const auto told = [](ScriptedServer&, LiveStream& stream) { return !stream.words(now()).alert.empty(); };
  EXPECT_LT(seconds_to_end([](unsigned, Peer& peer) { peer.hold_until_gone(); }, visited), 5) << "no Welcome comes";
  EXPECT_LT(seconds_to_end(
                [](unsigned, Peer& peer) {
                  peer.read();
                  peer.send(goodbye(wire::Goodbye::SERVER_FULL, "full"));
                },
                told),
            5)
      << "the next try is due in ten seconds";
}

}  // namespace
}  // namespace darm::client::desktop
