#include "actors/session/link_pace.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <utility>

namespace darm::session {
namespace {

constexpr Microseconds kMs = 1'000;
constexpr Microseconds kSecond = 1'000'000;

// A line of one rate and delay: what is written arrives in order, and pongs come back.
class Line {
 public:
  Line(double bytes_per_second, Microseconds round_trip) : rate_(bytes_per_second), round_trip_(round_trip) {}

  void write(std::size_t bytes) {
    const auto before = std::max(free_, now);
    free_ = before + static_cast<Microseconds>(static_cast<double>(bytes) / rate_ * 1e6);
    const auto numbers = pace.write(bytes, now);
    if (numbers.in_front) pongs_.emplace_back(before + round_trip_, *numbers.in_front);
    if (numbers.behind) pongs_.emplace_back(free_ + round_trip_ + std::exchange(held_up_, 0), *numbers.behind);
    pings += (numbers.in_front ? 1 : 0) + (numbers.behind ? 1 : 0);
    pace.taken();
  }
  void run(Microseconds time) {
    const auto end = now + time;
    while (!pongs_.empty() && pongs_.front().first <= end) {
      now = std::max(now, pongs_.front().first);
      pace.pong(pongs_.front().second, now);
      pongs_.pop_front();
    }
    now = end;
  }
  void get_to_know() {
    for (const std::size_t bytes : {200'000u, 400'000u, 400'000u}) {
      write(bytes);
      run(2 * kSecond);
    }
  }
  void lose_a_packet() { held_up_ = round_trip_; }
  void stall(Microseconds time) {
    for (auto& [at, ping] : pongs_) at += time;
    free_ = std::max(free_, now) + time;
  }

  LinkPace pace;
  Microseconds now = kSecond;
  int pings = 0;

 private:
  double rate_;
  Microseconds round_trip_, free_ = 0, held_up_ = 0;
  std::deque<std::pair<Microseconds, std::int64_t>> pongs_;
};

TEST(LinkPace, LearnsWhatASlowLineCarries) {
  Line line(625e3, 100 * kMs);
  for (int i = 0; i < 20; ++i) {
    line.write(100'000 + 20'000 * static_cast<std::size_t>(i % 5));
    line.run(kSecond);
  }
  EXPECT_NEAR(line.pace.bytes_per_second(), 625e3, 30e3);
  EXPECT_EQ(line.pace.round_trip(), 100 * kMs);
}

TEST(LinkPace, LostPacketsAreNotTakenForASlowerLine) {
  Line line(625e3, 100 * kMs);
  line.get_to_know();
  for (int i = 0; i < 40; ++i) {
    if (i % 2 == 0) line.lose_a_packet();
    line.write(40'000);
    line.run(kSecond);
  }
  EXPECT_GT(line.pace.bytes_per_second(), 500e3);
}

TEST(LinkPace, IsFullUntilWhatWasSentHasArrivedAndThenFree) {
  Line line(625e3, 100 * kMs);
  line.get_to_know();
  EXPECT_FALSE(line.pace.full(0, line.now));
  line.write(300'000);  // half a second
  EXPECT_TRUE(line.pace.full(0, line.now));
  line.run(300 * kMs);
  EXPECT_TRUE(line.pace.full(0, line.now)) << "though the kernel has taken it";
  line.run(400 * kMs);
  EXPECT_FALSE(line.pace.full(0, line.now));
  EXPECT_TRUE(line.pace.full(300'000, line.now)) << "what waits here counts";
}

TEST(LinkPace, AFarLineMayHoldAFrameForEachOfItsRoundTrips) {
  Line line(5e6, 400 * kMs);
  line.get_to_know();
  line.write(300'000);
  EXPECT_FALSE(line.pace.full(0, line.now));
  line.write(300'000);
  line.write(3'000'000);
  EXPECT_TRUE(line.pace.full(0, line.now));
}

TEST(LinkPace, ALineThatStandsIsFullAndFreeWhenItGoesOn) {
  Line line(5e6, 20 * kMs);
  line.get_to_know();
  line.write(30'000);
  line.stall(5 * kSecond);
  line.run(100 * kMs);
  EXPECT_FALSE(line.pace.full(0, line.now)) << "nothing is known of it yet";
  line.run(400 * kMs);
  EXPECT_TRUE(line.pace.full(0, line.now));
  line.run(4'600 * kMs);
  EXPECT_FALSE(line.pace.full(0, line.now));
  EXPECT_GT(line.pace.bytes_per_second(), 3e6) << "a stall says little of the rate";
}

TEST(LinkPace, AWriteThatIsNotTakenIsAStandingLineToo) {
  LinkPace pace;
  static_cast<void>(pace.write(100, 0));
  EXPECT_TRUE(pace.full(0, kSecond));
  pace.taken();
}

TEST(LinkPace, AFastLineIsHardlyPingedAndNeverFull) {
  Line line(100e6, kMs);
  for (int i = 0; i < 100; ++i) {  // ten a second
    line.write(50'000);
    EXPECT_FALSE(i > 5 && line.pace.full(0, line.now));
    line.run(100 * kMs);
  }
  EXPECT_LE(line.pings, 8);
}

TEST(LinkPace, SmallAnswersAreNotPingedOneByOne) {
  Line line(100e6, kMs);
  for (int i = 0; i < 100; ++i) {
    line.write(60);
    line.run(100 * kMs);
  }
  EXPECT_LE(line.pings, 6);
}

TEST(LinkPace, AClientThatDoesNotKnowPingsIsLeftAlone) {
  LinkPace pace;
  EXPECT_TRUE(pace.write(100'000, 0).behind);
  pace.taken();
  EXPECT_TRUE(pace.full(0, kSecond));
  EXPECT_FALSE(pace.write(100'000, 6 * kSecond).behind);
  pace.taken();
  EXPECT_FALSE(pace.full(0, 60 * kSecond));
  const auto later = pace.write(100'000, 60 * kSecond);
  EXPECT_FALSE(later.in_front || later.behind);
}

TEST(LinkPace, AClientThatIsSlowToAnswerAtFirstIsNotTakenForDeafForEver) {
  LinkPace pace;
  const auto ping = pace.write(100, 0).behind;
  pace.taken();
  EXPECT_FALSE(pace.full(0, 10 * kSecond));
  pace.pong(*ping, 10 * kSecond);
  EXPECT_TRUE(pace.write(100'000, 11 * kSecond).behind);
}

TEST(LinkPace, PongsToNothingAreIgnored) {
  LinkPace pace;
  const auto first = pace.write(100'000, 10);
  EXPECT_FALSE(first.in_front) << "a welcome comes first";
  const auto ping = first.behind;
  ASSERT_TRUE(ping);
  pace.taken();
  pace.pong(*ping + 1, 20);
  pace.pong(-1, 20);
  EXPECT_EQ(pace.bytes_per_second(), 0);
  EXPECT_TRUE(pace.full(0, kSecond));
  pace.pong(*ping, kSecond);
  EXPECT_FALSE(pace.full(0, kSecond));
  pace.pong(*ping, 2 * kSecond);  // again
  EXPECT_EQ(pace.round_trip(), kSecond - 10);
}

}  // namespace
}  // namespace darm::session
