#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <future>
#include <string>

#include "daemon/lifecycle/service_notifier.hpp"
#include "daemon/lifecycle/stop_count.hpp"
#include "daemon/lifecycle/stop_deadline.hpp"
#include "daemon/lifecycle/stop_signals.hpp"

namespace darm::lifecycle {
namespace {

using namespace std::chrono_literals;

// A service manager's end of the notification socket.
class Manager {
 public:
  explicit Manager(std::string name) : name_(std::move(name)), fd_(socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, name_.data(), name_.size());
    if (name_[0] == '@') address.sun_path[0] = '\0';
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name_.size());
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&address), length), 0);
  }
  ~Manager() {
    close(fd_);
    if (name_[0] == '/') unlink(name_.c_str());
  }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::string next() const {
    char buffer[512];
    const ssize_t n = recv(fd_, buffer, sizeof buffer, 0);
    return {buffer, static_cast<std::size_t>(n < 0 ? 0 : n)};
  }

 private:
  std::string name_;
  int fd_;
};

std::string unique(const char* prefix) { return prefix + std::string("darm-notify-test-") + std::to_string(getpid()); }

TEST(ServiceNotifierTest, SendsStatesToTheSocket) {
  for (const char* prefix : {"/tmp/", "@"}) {
    const Manager manager(unique(prefix));
    const ServiceNotifier notifier(manager.name());
    ASSERT_TRUE(notifier.active());
    notifier.ready("serving\nREADY=0");
    EXPECT_EQ(manager.next(), "READY=1\nSTATUS=serving READY=0");
    notifier.watchdog();
    EXPECT_EQ(manager.next(), "WATCHDOG=1");
    notifier.stopping();
    EXPECT_EQ(manager.next(), "STOPPING=1");
  }
}

TEST(ServiceNotifierTest, EnvironmentGivesSocketAndWatchdogAndIsCleared) {
  const Manager manager(unique("@"));
  setenv("NOTIFY_SOCKET", manager.name().c_str(), 1);
  setenv("WATCHDOG_USEC", "3000000", 1);
  setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  const auto notifier = ServiceNotifier::from_environment();
  EXPECT_TRUE(notifier.active());
  EXPECT_EQ(notifier.watchdog_interval(), 1500ms);
  EXPECT_EQ(getenv("NOTIFY_SOCKET"), nullptr);
  EXPECT_EQ(getenv("WATCHDOG_USEC"), nullptr);
}

TEST(ServiceNotifierTest, WatchdogOfAnotherProcessIsNotOurs) {
  const Manager manager(unique("@"));
  setenv("NOTIFY_SOCKET", manager.name().c_str(), 1);
  setenv("WATCHDOG_USEC", "3000000", 1);
  setenv("WATCHDOG_PID", "1", 1);
  EXPECT_FALSE(ServiceNotifier::from_environment().watchdog_interval());
}

TEST(ServiceNotifierTest, WithoutASocketNothingHappens) {
  for (const std::string& path :
       {std::string(), std::string("relative"), std::string("/nowhere/socket"), std::string(500, '/')}) {
    const ServiceNotifier notifier(path, 1s);
    EXPECT_FALSE(notifier.active());
    EXPECT_FALSE(notifier.watchdog_interval());
    notifier.ready("x");
  }
}

TEST(StopSignalsTest, SignalsArriveAsCalls) {
  std::promise<int> first;
  std::promise<int> second;
  int calls = 0;
  const StopSignals signals([&](int number) { (++calls == 1 ? first : second).set_value(number); });
  kill(getpid(), SIGTERM);
  EXPECT_EQ(first.get_future().get(), SIGTERM);
  kill(getpid(), SIGINT);
  EXPECT_EQ(second.get_future().get(), SIGINT);
}

TEST(StopSignalsTest, ASignalFromBeforeIsNotLost) {
  hold_stop_signals();
  kill(getpid(), SIGINT);
  std::promise<int> first;
  const StopSignals signals([&](int number) { first.set_value(number); });
  EXPECT_EQ(first.get_future().get(), SIGINT);
}

TEST(StopSignalsTest, WhoIgnoresHangUpsGoesOn) {
  const auto before = signal(SIGHUP, SIG_IGN);
  {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_UNBLOCK, &all, nullptr);
    std::promise<int> first;
    const StopSignals signals([&](int number) { first.set_value(number); });
    kill(getpid(), SIGHUP);
    kill(getpid(), SIGTERM);
    EXPECT_EQ(first.get_future().get(), SIGTERM);
  }
  signal(SIGHUP, before);
}

TEST(StopCountTest, OneWishSentTwiceIsOneWish) {
  using Wish = StopCount::Wish;
  const auto now = std::chrono::steady_clock::now();
  StopCount count;
  EXPECT_EQ(count.signal(now), Wish::kStop);
  EXPECT_EQ(count.signal(now), Wish::kNothingNew);
  EXPECT_EQ(count.signal(now + 200ms), Wish::kNothingNew);
  EXPECT_EQ(count.signal(now + 1500ms), Wish::kLeave);
}

TEST(StopSignalsTest, EndsWithoutASignal) {
  const StopSignals signals([](int) { FAIL(); });
}

TEST(StopDeadlineTest, LeavesWhenTheStopIsLate) {
  std::promise<void> left;
  std::string order;
  {
    const StopDeadline deadline(
        1ms, [&] { order += "late "; },
        [&] {
          order += "left";
          left.set_value();
        });
    left.get_future().get();
  }
  EXPECT_EQ(order, "late left");
}

TEST(StopDeadlineTest, StaysQuietWhenTheStopIsInTime) {
  const StopDeadline deadline(10min, [] { FAIL(); }, [] { FAIL(); });
}

}  // namespace
}  // namespace darm::lifecycle
