#include "client/probe/lag_log.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace darm::client::probe {
namespace {

// A frame that was 10 us in each stage of the server, whose clock is 1,000,000 ahead; the camera was sent at `sent`.
wire::Stamps stamps(std::int64_t sent) {
  wire::Stamps s;
  std::int64_t t = 1'000'000 + sent + 30;  // 30 us on the way up
  s.set_client_sent(sent);
  s.set_camera_received(t);
  s.set_view_started(t += 10);
  s.set_view_ready(t += 10);
  s.set_composed(t += 10);
  s.set_encode_started(t += 10);
  s.set_picture_composed(t += 10);
  s.set_encoded(t += 10);
  s.set_sent(t += 10);
  return s;
}

std::int64_t sum(const LagSample& s) { return std::accumulate(s.stages.begin(), s.stages.end(), std::int64_t{0}); }

TEST(LagLog, StagesAddUpToWhatTheClientSaw) {
  LagLog log;
  log.camera_sent(1, 500);
  log.picture_decoded(1, stamps(500), {700, 720, 750});
  EXPECT_TRUE(log.samples(1'000'000).empty()) << "not on the screen yet";
  log.drawn(800);
  const auto samples = log.samples(1'000'000);
  ASSERT_EQ(samples.size(), 1u);
  EXPECT_EQ(samples[0].stages,
            (std::array<std::int64_t, kLagStageCount>{0, 30, 10, 10, 10, 10, 10, 10, 10, 100, 20, 30, 50}));
  EXPECT_EQ(samples[0].whole, 300);
  // A clock that is wrong by 20 parts the way up from the way down otherwise, and changes no sum.
  const auto wrong = log.samples(1'000'020);
  EXPECT_EQ(wrong[0].stages[1], 10);
  EXPECT_EQ(wrong[0].stages[9], 120);
  EXPECT_EQ(sum(wrong[0]), 300);
}

TEST(LagLog, ACameraThatANewerOneOvertookWaitedForIt) {
  LagLog log;
  log.camera_sent(1, 400);
  log.camera_sent(2, 500);
  log.camera_sent(3, 600);
  log.picture_decoded(2, stamps(500), {700, 720, 750});
  log.drawn(800);
  const auto samples = log.samples(1'000'000);
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_EQ(samples[0].stages[0], 100);
  EXPECT_EQ(samples[0].whole, 400);
  EXPECT_EQ(samples[1].whole, 300);
  for (const auto& s : samples) EXPECT_EQ(sum(s), s.whole);
}

TEST(LagLog, AnAnswerWithoutAPictureIsNoSampleAndAPictureIsDrawnOnce) {
  LagLog log;
  log.camera_sent(1, 400);
  log.no_change(1);
  log.camera_sent(2, 500);
  log.picture_decoded(1, stamps(400), {700, 720, 750});  // answers nothing that waits
  log.picture_decoded(2, stamps(500), {760, 770, 780});
  log.drawn(800);
  log.drawn(900);
  ASSERT_EQ(log.samples(0).size(), 1u);
  EXPECT_EQ(log.samples(0)[0].whole, 300);
}

TEST(LagLog, AStageWithoutAStampTookNoTime) {
  auto s = stamps(500);
  s.set_encode_started(0);
  s.set_picture_composed(0);
  LagLog log;
  log.camera_sent(1, 500);
  log.picture_decoded(1, s, {700, 720, 750});
  log.drawn(800);
  const auto sample = log.samples(1'000'000).at(0);
  EXPECT_EQ(sample.stages[5], 0);
  EXPECT_EQ(sample.stages[6], 0);
  EXPECT_EQ(sample.stages[7], 30) << "encoding has the time between the stamps that there are";
  EXPECT_EQ(sum(sample), 300);
}

}  // namespace
}  // namespace darm::client::probe
