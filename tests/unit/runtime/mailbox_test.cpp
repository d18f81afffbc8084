#include "actors/runtime/mailbox.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "actors/runtime/supervisor.hpp"

namespace darm::runtime {
namespace {

struct Command {
  static constexpr auto kOverflow = Overflow::kReject;
  int value = 0;
};
struct Sample {
  static constexpr auto kOverflow = Overflow::kDropOldest;
  int value = 0;
};
struct Newest {
  static constexpr auto kOverflow = Overflow::kLatestOnly;
  int value = 0;
};
struct PerKey {
  static constexpr auto kOverflow = Overflow::kLatestByKey;
  std::uint64_t id = 0;
  int value = 0;
  [[nodiscard]] std::uint64_t key() const { return id; }
};
struct Heavy {
  static constexpr auto kOverflow = Overflow::kReject;
  std::unique_ptr<int> payload;
};
using Inbox = std::variant<Command, Sample, Newest, PerKey, Heavy>;

// What waits, oldest first, as "type index * 100 + value".
std::vector<int> drain(Mailbox<Inbox>& box) {
  std::vector<int> all;
  while (auto message = box.pop()) {
    const int type = static_cast<int>(message->index()) * 100;
    if (const auto* c = std::get_if<Command>(&*message)) all.push_back(type + c->value);
    if (const auto* s = std::get_if<Sample>(&*message)) all.push_back(type + s->value);
    if (const auto* n = std::get_if<Newest>(&*message)) all.push_back(type + n->value);
    if (const auto* k = std::get_if<PerKey>(&*message)) all.push_back(type + k->value);
  }
  return all;
}

struct MailboxTest : ::testing::Test {
  template <class M>
  Delivery push(M message) {
    dropped.reset();
    return box.push(std::move(message), dropped);
  }
  Mailbox<Inbox> box{3};
  std::optional<Inbox> dropped;
};

TEST_F(MailboxTest, MessagesLeaveInTheOrderOfTheirArrival) {
  push(Command{1});
  push(Sample{2});
  push(Command{3});
  EXPECT_EQ(drain(box), (std::vector{1, 102, 3}));
}

TEST_F(MailboxTest, FullBoxRefusesCommandsAndKeepsThoseThatWait) {
  for (int i = 0; i < 3; ++i) EXPECT_EQ(push(Command{i}), Delivery::kQueued);
  EXPECT_EQ(push(Command{9}), Delivery::kRefusedFull);
  EXPECT_FALSE(dropped.has_value());
  EXPECT_EQ(drain(box), (std::vector{0, 1, 2}));
  EXPECT_EQ(push(Command{4}), Delivery::kQueued);
}

TEST_F(MailboxTest, RefusedMessageIsLeftUntouched) {
  for (int i = 0; i < 3; ++i) push(Command{i});
  Heavy heavy{std::make_unique<int>(7)};
  EXPECT_EQ(box.push(std::move(heavy), dropped), Delivery::kRefusedFull);
  ASSERT_NE(heavy.payload, nullptr);
  EXPECT_EQ(*heavy.payload, 7);
}

TEST_F(MailboxTest, TelemetryDropsItsOwnOldest) {
  push(Command{1});
  push(Sample{1});
  push(Sample{2});
  EXPECT_EQ(push(Sample{3}), Delivery::kMadeRoom);
  ASSERT_TRUE(dropped.has_value());
  EXPECT_EQ(std::get<Sample>(*dropped).value, 1);
  EXPECT_EQ(drain(box), (std::vector{1, 102, 103}));
}

TEST_F(MailboxTest, TelemetryNeverDropsACommand) {
  for (int i = 0; i < 3; ++i) push(Command{i});
  EXPECT_EQ(push(Sample{1}), Delivery::kRefusedFull);
  EXPECT_EQ(drain(box), (std::vector{0, 1, 2}));
}

TEST_F(MailboxTest, LatestOnlyReplacesInPlace) {
  push(Newest{1});
  push(Command{5});
  EXPECT_EQ(push(Newest{2}), Delivery::kReplaced);
  ASSERT_TRUE(dropped.has_value());
  EXPECT_EQ(std::get<Newest>(*dropped).value, 1);
  EXPECT_EQ(drain(box), (std::vector{202, 5}));
}

TEST_F(MailboxTest, LatestOnlyIsTakenByAFullBox) {
  for (int i = 0; i < 3; ++i) push(Command{i});
  EXPECT_EQ(push(Newest{1}), Delivery::kQueued);
  EXPECT_EQ(push(Command{9}), Delivery::kRefusedFull);
  EXPECT_EQ(box.size(), 4u);
}

TEST_F(MailboxTest, LatestByKeyKeepsOnePerKeyWithinTheBound) {
  EXPECT_EQ(push(PerKey{1, 1}), Delivery::kQueued);
  EXPECT_EQ(push(PerKey{2, 2}), Delivery::kQueued);
  EXPECT_EQ(push(PerKey{1, 3}), Delivery::kReplaced);
  EXPECT_EQ(push(PerKey{3, 4}), Delivery::kQueued);
  EXPECT_EQ(push(PerKey{4, 5}), Delivery::kRefusedFull);
  EXPECT_EQ(push(PerKey{2, 6}), Delivery::kReplaced);
  EXPECT_EQ(drain(box), (std::vector{303, 306, 304}));
}

TEST_F(MailboxTest, AfterItLeftALatestMessageQueuesAnew) {
  push(Newest{1});
  (void)box.pop();
  EXPECT_EQ(push(Newest{2}), Delivery::kQueued);
  push(PerKey{1, 1});
  (void)box.pop();
  (void)box.pop();
  EXPECT_EQ(push(PerKey{1, 2}), Delivery::kQueued);
}

TEST(MailboxCapacityTest, ZeroMeansOne) {
  Mailbox<Inbox> box(0);
  std::optional<Inbox> dropped;
  EXPECT_EQ(box.push(Command{1}, dropped), Delivery::kQueued);
  EXPECT_EQ(box.push(Command{2}, dropped), Delivery::kRefusedFull);
}

TEST(MessageNameTest, IsTheUnqualifiedTypeName) {
  EXPECT_EQ(message_name<Command>(), "Command");
  EXPECT_EQ(message_name<PerKey>(), "PerKey");
}

TEST(SupervisorTest, KindIsTheNameUpToTheSlash) {
  EXPECT_EQ(kind_of("session/12"), "session");
  EXPECT_EQ(kind_of("renderer"), "renderer");
  EXPECT_EQ(kind_of(""), "");
}

TEST(SupervisorTest, UnknownKindEscalates) {
  Supervisor supervisor;
  int escalated = 0;
  supervisor.on_escalate([&](const Failure&) { ++escalated; });
  supervisor.set("session", {.action = FailureAction::kStopActor});
  supervisor.apply(supervisor.policy_of("session/1"), Failure{});
  EXPECT_EQ(escalated, 0);
  supervisor.apply(supervisor.policy_of("atlas"), Failure{});
  EXPECT_EQ(escalated, 1);
}

}  // namespace
}  // namespace darm::runtime
