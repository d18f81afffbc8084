#include "client/load/answer_log.hpp"

#include <gtest/gtest.h>

namespace darm::client::load {
namespace {

TEST(AnswerLog, EachCameraWaitsUntilItOrANewerOneIsAnswered) {
  AnswerLog log;
  std::vector<float> waits;
  log.sent(1, 1'000);
  log.sent(2, 101'000);
  log.sent(3, 201'000);
  EXPECT_EQ(log.answered(2, 251'000, waits), AnswerNews::kAnswer);
  EXPECT_EQ(waits, (std::vector<float>{250, 150}));
  EXPECT_EQ(log.waiting(), 1u);
  EXPECT_EQ(log.answered(3, 261'000, waits), AnswerNews::kAnswer);
  EXPECT_EQ(waits.back(), 60);
}

TEST(AnswerLog, OnlyTheFirstMessageAnswers) {
  AnswerLog log;
  std::vector<float> waits;
  log.sent(1, 0);
  EXPECT_EQ(log.answered(0, 10, waits), AnswerNews::kNone);
  EXPECT_EQ(log.answered(1, 20, waits), AnswerNews::kAnswer);
  EXPECT_EQ(log.answered(1, 30, waits), AnswerNews::kAgain);
  EXPECT_EQ(waits.size(), 1u);
}

TEST(AnswerLog, AnAnswerToAnOlderCameraGoesBackwards) {
  AnswerLog log;
  std::vector<float> waits;
  log.sent(1, 0);
  log.sent(2, 0);
  EXPECT_EQ(log.answered(2, 10, waits), AnswerNews::kAnswer);
  EXPECT_EQ(log.answered(1, 20, waits), AnswerNews::kBackwards);
}

TEST(AnswerLog, AnAnswerToACameraThatWasNeverSentIsFound) {
  AnswerLog log;
  std::vector<float> waits;
  EXPECT_EQ(log.answered(1, 0, waits), AnswerNews::kUnsent);
  log.sent(1, 0);
  EXPECT_EQ(log.answered(2, 10, waits), AnswerNews::kUnsent);
  EXPECT_TRUE(waits.empty());
}

TEST(AnswerLog, WhoWaitsLongCountsWithWhatTheyHaveWaited) {
  AnswerLog log;
  std::vector<float> waits;
  log.sent(1, 0);
  log.sent(2, 1'000'000);
  log.sent(3, 2'900'000);
  log.still_waiting(500'000, 3'000'000, 1'000'000, waits);
  EXPECT_EQ(waits, std::vector<float>{2'000}) << "not what was sent before the time, nor what may yet be in time";
}

TEST(AnswerLog, MemoryIsBounded) {
  AnswerLog log;
  for (std::uint64_t i = 1; i <= AnswerLog::kMostWaiting + 100; ++i) log.sent(i, 0);
  EXPECT_EQ(log.waiting(), AnswerLog::kMostWaiting);
}

}  // namespace
}  // namespace darm::client::load
