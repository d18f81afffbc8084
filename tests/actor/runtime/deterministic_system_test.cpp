#include "actors/runtime/deterministic_system.hpp"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "actors/runtime/registry.hpp"

namespace darm::runtime {
namespace {

using namespace std::chrono_literals;

struct Ball {
  static constexpr auto kOverflow = Overflow::kReject;
  int left = 0;
};
struct Explode {
  static constexpr auto kOverflow = Overflow::kReject;
};
struct Latest {
  static constexpr auto kOverflow = Overflow::kLatestOnly;
  int value = 0;
};
using Inbox = std::variant<Ball, Explode, Latest>;

struct Journal {
  std::vector<std::string> lines;
  Ref<Inbox> other;
};

class Player : public Actor<Inbox> {
 public:
  Player(Context<Inbox> context, std::shared_ptr<Journal> journal)
      : Actor(std::move(context)), journal_(std::move(journal)) {}
  ~Player() override { journal_->lines.push_back(name() + " gone"); }
  void on_start() override { journal_->lines.push_back(name() + " start"); }
  void on(Ball&& ball) {
    journal_->lines.push_back(name() + " ball " + std::to_string(ball.left));
    if (ball.left > 0) journal_->other.tell(Ball{ball.left - 1});
  }
  void on(Explode&&) { throw std::runtime_error("boom"); }
  void on(Latest&& latest) { journal_->lines.push_back("latest " + std::to_string(latest.value)); }

 private:
  std::shared_ptr<Journal> journal_;
};

struct CountingSink : MetricSink {
  void count(std::string_view name, double n, Labels labels) override {
    std::string key(name);
    for (const auto& label : labels) key.append(1, ',').append(label.value);
    counts[key] += n;
  }
  void observe(std::string_view, double, Labels) override { ++observations; }
  void set(std::string_view, double, Labels) override {}
  std::map<std::string, double> counts;
  int observations = 0;
};

struct DeterministicSystemTest : ::testing::Test {
  CountingSink sink;
  std::shared_ptr<Journal> journal = std::make_shared<Journal>();
  DeterministicSystem system{2, &sink};
};

TEST_F(DeterministicSystemTest, StartComesBeforeTheFirstMessage) {
  const auto a = system.spawn<Player>("a", 8, journal);
  EXPECT_TRUE(a.tell(Ball{0}));
  EXPECT_TRUE(journal->lines.empty());
  system.run_until_idle();
  EXPECT_EQ(journal->lines, (std::vector<std::string>{"a start", "a ball 0"}));
}

TEST_F(DeterministicSystemTest, OrderOfMessagesIsLogged) {
  const auto a = system.spawn<Player>("a", 8, journal);
  const auto b = system.spawn<Player>("b", 8, journal);
  journal->other = b;
  a.tell(Ball{1});
  b.tell(Latest{1});
  system.run_until_idle();
  using Handled = DeterministicSystem::Handled;
  EXPECT_EQ(system.messages_log(), (std::vector<Handled>{{"a", "Ball"}, {"b", "Latest"}, {"b", "Ball"}}));
}

TEST_F(DeterministicSystemTest, EndlessGameIsReported) {
  const auto a = system.spawn<Player>("a", 8, journal);
  journal->other = a;
  a.tell(Ball{1 << 30});
  EXPECT_THROW(system.run_until_idle(1000), std::runtime_error);
}

TEST_F(DeterministicSystemTest, StoppedActorFinishesNothingMoreAndRefuses) {
  const auto a = system.spawn<Player>("a", 8, journal);
  system.run_until_idle();
  a.tell(Ball{0});
  system.stop(a);
  EXPECT_FALSE(a.tell(Ball{0}));
  EXPECT_FALSE(static_cast<bool>(a));
  system.run_until_idle();
  EXPECT_EQ(journal->lines, (std::vector<std::string>{"a start", "a gone"}));
  EXPECT_EQ((sink.counts["darm_actor_drops_total,a,stopped"]), 2);
}

TEST_F(DeterministicSystemTest, StopIsNeverRefusedByAFullMailbox) {
  const auto a = system.spawn<Player>("a", 1, journal);
  a.tell(Ball{0});
  EXPECT_FALSE(a.tell(Ball{0}));
  system.stop(a);
  system.run_until_idle();
  EXPECT_EQ(journal->lines, (std::vector<std::string>{"a gone"}));
}

TEST_F(DeterministicSystemTest, ThrowingHandlerEndsTheActorAndItsPolicyIsApplied) {
  std::vector<std::string> seen;
  int escalations = 0;
  system.supervisor().on_escalate([&](const Failure&) { ++escalations; });
  system.supervisor().set("p", {FailureAction::kStopActor, [&](const Failure& failure) {
                                  seen.push_back(failure.actor + "|" + failure.message + "|" + failure.what);
                                  journal->lines.push_back("policy");
                                }});
  const auto a = system.spawn<Player>("p/7", 8, journal);
  a.tell(Explode{});
  a.tell(Ball{0});
  system.run_until_idle();
  EXPECT_EQ(seen, (std::vector<std::string>{"p/7|Explode|boom"}));
  EXPECT_EQ(journal->lines, (std::vector<std::string>{"p/7 start", "p/7 gone", "policy"}));
  EXPECT_EQ(escalations, 0);
  EXPECT_FALSE(a.tell(Ball{0}));
  EXPECT_EQ(system.failures().size(), 1u);
}

TEST_F(DeterministicSystemTest, PolicyMaySpawnTheSuccessor) {
  Ref<Inbox> second;
  system.supervisor().set("p", {FailureAction::kStopActor, [&](const Failure& failure) {
                                  second = system.spawn<Player>(failure.actor, 8, journal);
                                }});
  const auto first = system.spawn<Player>("p", 8, journal);
  first.tell(Explode{});
  system.run_until_idle();
  EXPECT_TRUE(second.tell(Ball{0}));
  system.run_until_idle();
  EXPECT_EQ(journal->lines.back(), "p ball 0");
}

TEST_F(DeterministicSystemTest, FailureOfAnActorOutsideTheTableEscalates) {
  std::string who;
  system.supervisor().on_escalate([&](const Failure& failure) { who = failure.actor; });
  system.spawn<Player>("atlas", 8, journal).tell(Explode{});
  system.run_until_idle();
  EXPECT_EQ(who, "atlas");
}

TEST_F(DeterministicSystemTest, PoolWorkRunsByPriorityThenOrder) {
  std::string order;
  system.executor().post(Priority::kLow, [&] { order += 'l'; });
  system.executor().post(Priority::kNormal, [&] { order += '1'; });
  system.executor().post(Priority::kNormal, [&] { order += '2'; });
  system.executor().post(Priority::kHigh, [&] { order += 'h'; });
  system.run_until_idle();
  EXPECT_EQ(order, "h12l");
}

TEST_F(DeterministicSystemTest, ThrowingWorkIsAFailureOfThePool) {
  system.supervisor().set("pool", {FailureAction::kStopActor, {}});
  system.executor().post(Priority::kNormal, [] { throw 7; });
  system.run_until_idle();
  ASSERT_EQ(system.failures().size(), 1u);
  EXPECT_EQ(system.failures()[0].actor, "pool");
}

TEST_F(DeterministicSystemTest, TimersFireInOrderOfTimeOnTheManualClock) {
  std::string order;
  const auto start = system.executor().now();
  system.executor().after(20ms, [&] { order += 'b'; });
  system.executor().after(10ms, [&] {
    order += 'a';
    EXPECT_EQ(system.executor().now() - start, 10ms);
    system.executor().after(5ms, [&] { order += 'c'; });
  });
  system.executor().after(30ms, [&] { order += 'd'; });
  system.run_until_idle();
  EXPECT_EQ(order, "");
  system.advance(20ms);
  EXPECT_EQ(order, "acb");
  EXPECT_EQ(system.pending_timers(), 1u);
  EXPECT_EQ(system.executor().now() - start, 20ms);
}

TEST_F(DeterministicSystemTest, ReplacedMessagesAreCounted) {
  const auto a = system.spawn<Player>("a", 8, journal);
  a.tell(Latest{1});
  a.tell(Latest{2});
  system.run_until_idle();
  EXPECT_EQ(journal->lines.back(), "latest 2");
  EXPECT_EQ((sink.counts["darm_actor_drops_total,a,replaced"]), 1);
  EXPECT_EQ((sink.counts["darm_actor_handled_total,a,Latest"]), 1);
  EXPECT_EQ(sink.observations, 1);
}

TEST(DeterministicSystemLifeTest, ActorsGoWithTheSystemAndRefsStayHarmless) {
  auto journal = std::make_shared<Journal>();
  Ref<Inbox> ref;
  {
    DeterministicSystem system;
    ref = system.spawn<Player>("a", 8, journal);
    system.executor().post(Priority::kNormal, [] { FAIL() << "queued work runs at shutdown"; });
  }
  EXPECT_EQ(journal->lines, (std::vector<std::string>{"a gone"}));
  EXPECT_FALSE(ref.tell(Ball{0}));
  EXPECT_FALSE(Ref<Inbox>().tell(Ball{0}));
}

TEST_F(DeterministicSystemTest, RegistryFindsBroadcastsAndForgets) {
  Registry<int, Inbox> registry;
  registry.add(2, system.spawn<Player>("a/2", 8, journal));
  registry.add(1, system.spawn<Player>("a/1", 8, journal));
  std::vector<int> ids;
  registry.for_each([&](int id, const Ref<Inbox>& ref) {
    ids.push_back(id);
    EXPECT_TRUE(ref.tell(Ball{0}));
    registry.remove(id);
  });
  EXPECT_EQ(ids, (std::vector{1, 2}));
  EXPECT_EQ(registry.size(), 0u);
  EXPECT_FALSE(registry.find(1).tell(Ball{0}));
}

}  // namespace
}  // namespace darm::runtime
