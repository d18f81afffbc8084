// Sessions with everything around them but clients: a scene, a scheduler that only looks, an io_context on a thread.
#pragma once

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <atomic>
#include <boost/asio.hpp>
#include <chrono>
#include <memory>
#include <thread>
#include <utility>

#include "actors/runtime/threaded_system.hpp"
#include "actors/session/session_actor.hpp"
#include "proto/darm.pb.h"
#include "proto/limits.hpp"
#include "tests/unit/session/small_scene.hpp"

namespace darm::session {

class SchedulerProbe : public runtime::Actor<tile_scheduler::Inbox> {
 public:
  struct Seen {
    std::atomic<int> opened{0}, closed{0};
    std::atomic<std::uint64_t> newest_view{0};
  };
  SchedulerProbe(runtime::Context<tile_scheduler::Inbox> context, Seen* seen)
      : Actor(std::move(context)), seen_(seen) {}
  void on(tile_scheduler::SessionOpened&&) { ++seen_->opened; }
  void on(tile_scheduler::SessionClosed&&) { ++seen_->closed; }
  void on(tile_scheduler::ViewChanged&& m) { seen_->newest_view = m.sequence; }
  template <class M>
  void on(M&&) {}

 private:
  Seen* seen_;
};

inline wire::Envelope hello() {
  wire::Envelope e;
  e.mutable_hello()->set_version(proto::kProtocolVersion);
  e.mutable_hello()->set_client("loopback");
  return e;
}

class SessionWorld : public ::testing::Test {
 protected:
  SessionWorld() {
    const auto [scene, layout] = testing::grid(100);
    around->scene = GeometryStream::build(scene, layout, 1.0f, 1).value();
    around->sessions = std::make_shared<SessionRegistry>();
    around->scheduler = system.spawn<SchedulerProbe>("tile_scheduler", 64, &seen);
  }
  /// Once listeners are open.
  void run() {
    thread = std::thread([this] { io.run(); });
  }
  /// Once listeners are stopped.
  void finish() {
    system.shutdown(std::chrono::seconds(10));
    thread.join();  // nothing is left that keeps the context running
  }
  static void give_up_after_ten_seconds(boost::asio::ip::tcp::socket& socket) {
    const timeval limit{10, 0};
    setsockopt(socket.native_handle(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  }
  template <class F>
  static bool eventually(F&& holds) {
    for (int i = 0; i < 1000 && !holds(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return holds();
  }

  SchedulerProbe::Seen seen;
  boost::asio::io_context io;
  runtime::ThreadedSystem system;
  std::shared_ptr<SessionSurroundings> around = std::make_shared<SessionSurroundings>();
  std::thread thread;
};

}  // namespace darm::session
