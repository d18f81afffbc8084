#include "actors/runtime/threaded_system.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace darm::runtime {
namespace {

using namespace std::chrono_literals;

struct Add {
  static constexpr auto kOverflow = Overflow::kReject;
  int n = 0;
};
struct Wait {
  static constexpr auto kOverflow = Overflow::kReject;
  std::shared_ptr<std::promise<void>> begun;
  std::shared_future<void> gate;
};
struct Done {
  static constexpr auto kOverflow = Overflow::kReject;
  std::shared_ptr<std::promise<long>> answer;
};
struct Fail {
  static constexpr auto kOverflow = Overflow::kReject;
};
using Inbox = std::variant<Add, Wait, Done, Fail>;

class Adder : public Actor<Inbox> {
 public:
  Adder(Context<Inbox> context, std::atomic<int>* alive) : Actor(std::move(context)), alive_(alive) { ++*alive_; }
  ~Adder() override { --*alive_; }
  void on(Add&& add) { sum_ += add.n; }
  void on(Wait&& wait) {
    wait.begun->set_value();
    wait.gate.wait();
  }
  void on(Done&& done) { done.answer->set_value(sum_); }
  void on(Fail&&) { throw std::runtime_error("boom"); }

 private:
  std::atomic<int>* alive_;
  long sum_ = 0;  // not atomic: only one thread at a time may touch it (ThreadSanitizer watches)
};

long ask(const Ref<Inbox>& ref) {
  auto answer = std::make_shared<std::promise<long>>();
  auto future = answer->get_future();
  while (!ref.tell(Done{answer})) std::this_thread::yield();
  return future.get();
}

TEST(ThreadedSystemTest, OneThreadAtATimeHandlesEachActor) {
  std::atomic<int> alive = 0;
  ThreadedSystem system({.workers = 2, .actor_threads = 3});
  std::vector<Ref<Inbox>> adders;
  for (int i = 0; i < 4; ++i) adders.push_back(system.spawn<Adder>("adder/" + std::to_string(i), 64, &alive));
  std::vector<std::thread> senders;
  for (int t = 0; t < 4; ++t)
    senders.emplace_back([&] {
      for (int i = 0; i < 4000; ++i)
        while (!adders[static_cast<std::size_t>(i % 4)].tell(Add{1})) std::this_thread::yield();
    });
  for (auto& sender : senders) sender.join();
  for (const auto& adder : adders) EXPECT_EQ(ask(adder), 4000);
  EXPECT_TRUE(system.shutdown(10s).empty());
  EXPECT_EQ(alive, 0);
}

TEST(ThreadedSystemTest, HandlersRunWhileEveryPoolThreadIsBusy) {
  std::atomic<int> alive = 0;
  std::promise<void> gate;
  const auto opened = gate.get_future().share();
  ThreadedSystem system({.workers = 2});
  for (unsigned i = 0; i < system.executor().workers(); ++i)
    system.executor().post(Priority::kHigh, [opened] { opened.wait(); });
  const auto adder = system.spawn<Adder>("adder", 8, &alive);
  adder.tell(Add{5});
  EXPECT_EQ(ask(adder), 5);
  gate.set_value();
}

TEST(ThreadedSystemTest, HigherPriorityIsTakenFirst) {
  ThreadedSystem system({.workers = 1});
  std::promise<void> gate;
  const auto opened = gate.get_future().share();
  std::promise<std::string> finished;
  std::string order;  // the only pool thread writes it
  system.executor().post(Priority::kHigh, [opened] { opened.wait(); });
  system.executor().post(Priority::kLow, [&] {
    order += 'l';
    finished.set_value(order);
  });
  system.executor().post(Priority::kNormal, [&] { order += 'n'; });
  system.executor().post(Priority::kHigh, [&] { order += 'h'; });
  gate.set_value();
  EXPECT_EQ(finished.get_future().get(), "hnl");
}

TEST(ThreadedSystemTest, ThreadTimeGoesOnWithWorkAndNotWithWaiting) {
  ThreadedSystem system({.workers = 1});
  const auto& executor = system.executor();
  const auto begin = executor.thread_time();
  while (executor.thread_time() - begin < 5ms) {  // ends only because this work counts
  }
  const auto before = executor.thread_time();
  std::this_thread::sleep_for(50ms);
  EXPECT_LT(executor.thread_time() - before, 25ms);
}

TEST(ThreadedSystemTest, TimersFire) {
  ThreadedSystem system({.workers = 1});
  const auto start = system.executor().now();
  std::promise<void> fired;
  system.executor().after(5ms, [&] { fired.set_value(); });
  fired.get_future().get();
  EXPECT_GE(system.executor().now() - start, 5ms);
}

TEST(ThreadedSystemTest, StopDestroysTheActorOnItsTurn) {
  std::atomic<int> alive = 0;
  ThreadedSystem system({.workers = 1});
  const auto adder = system.spawn<Adder>("adder", 8, &alive);
  EXPECT_EQ(ask(adder), 0);
  system.stop(adder);
  EXPECT_FALSE(adder.tell(Add{1}));
  while (alive != 0) std::this_thread::yield();
}

TEST(ThreadedSystemTest, FailureReachesThePolicyWithNameAndReason) {
  std::atomic<int> alive = 0;
  std::promise<Failure> failed;
  ThreadedSystem system({.workers = 1});
  system.supervisor().set("adder", {FailureAction::kStopActor, [&](const Failure& f) { failed.set_value(f); }});
  const auto adder = system.spawn<Adder>("adder/3", 8, &alive);
  adder.tell(Fail{});
  const auto failure = failed.get_future().get();
  EXPECT_EQ(failure.actor, "adder/3");
  EXPECT_EQ(failure.what, "boom");
  EXPECT_EQ(alive, 0);
}

TEST(ThreadedSystemTest, ThrowingPoolWorkIsAFailureAndThePoolGoesOn) {
  std::promise<Failure> failed;
  ThreadedSystem system({.workers = 1});
  system.supervisor().set("pool", {FailureAction::kStopActor, [&](const Failure& f) { failed.set_value(f); }});
  system.executor().post(Priority::kNormal, [] { throw std::runtime_error("slice"); });
  EXPECT_EQ(failed.get_future().get().what, "slice");
  std::promise<void> after;
  system.executor().post(Priority::kNormal, [&] { after.set_value(); });
  after.get_future().get();
}

TEST(ThreadedSystemTest, ShutdownNamesWhoIsLateAndEndsOnceTheyAreDone) {
  std::atomic<int> alive = 0;
  std::promise<void> gate;
  const auto opened = gate.get_future().share();
  ThreadedSystem system({.workers = 1});
  const auto slow = system.spawn<Adder>("slow", 8, &alive);
  const auto quick = system.spawn<Adder>("quick", 8, &alive);
  EXPECT_EQ(ask(quick), 0);
  auto begun = std::make_shared<std::promise<void>>();
  auto waiting = begun->get_future();
  slow.tell(Wait{begun, opened});
  waiting.get();
  auto started = std::make_shared<std::promise<void>>();
  auto running = started->get_future();
  system.executor().post(Priority::kNormal, [opened, started] {
    started->set_value();
    opened.wait();
  });
  running.get();
  const auto late = system.shutdown(50ms);
  ASSERT_EQ(late.size(), 2u);
  EXPECT_EQ(late[0], "slow");
  EXPECT_EQ(late[1], "pool (1 slices running)");
  EXPECT_FALSE(system.spawn<Adder>("new", 8, &alive));
  gate.set_value();
  EXPECT_TRUE(system.shutdown(10s).empty());
  EXPECT_EQ(alive, 0);
}

TEST(ThreadedSystemTest, ShutdownWhileEveryoneIsTalkingIsClean) {
  std::atomic<int> alive = 0;
  std::atomic<bool> go_on = true;
  std::vector<Ref<Inbox>> adders;
  std::vector<std::thread> senders;
  {
    ThreadedSystem system({.workers = 2});
    for (int i = 0; i < 3; ++i) adders.push_back(system.spawn<Adder>("adder/" + std::to_string(i), 16, &alive));
    for (int t = 0; t < 2; ++t)
      senders.emplace_back([&adders, &go_on] {
        while (go_on)
          for (const auto& adder : adders) adder.tell(Add{1});
      });
    for (int i = 0; i < 50; ++i) system.executor().post(Priority::kNormal, [adder = adders[0]] { adder.tell(Add{1}); });
    EXPECT_GE(ask(adders[1]), 0);
  }
  go_on = false;
  for (auto& sender : senders) sender.join();
  EXPECT_EQ(alive, 0);
  EXPECT_FALSE(adders[0].tell(Add{1}));
}

}  // namespace
}  // namespace darm::runtime
