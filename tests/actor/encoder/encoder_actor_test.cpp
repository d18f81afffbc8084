#include "actors/encoder/encoder_actor.hpp"

#include <gtest/gtest.h>

#include "actors/encoder/coarse_encoder_actor.hpp"
#include "actors/runtime/deterministic_system.hpp"

namespace darm::encoder {
namespace {

// Records what a session receives.
class SessionProbe : public runtime::Actor<session::Inbox> {
 public:
  struct Seen {
    std::vector<session::FrameEncoded> frames;
    std::vector<std::uint32_t> coarse_versions;
  };
  SessionProbe(runtime::Context<session::Inbox> context, Seen* seen) : Actor(std::move(context)), seen_(seen) {}
  void on(session::FrameEncoded&& m) { seen_->frames.push_back(std::move(m)); }
  void on(session::CoarseUpdated&& m) { seen_->coarse_versions.push_back(m.coarse->version); }
  template <class M>
  void on(M&&) {}

 private:
  Seen* seen_;
};

class SchedulerProbe : public runtime::Actor<tile_scheduler::Inbox> {
 public:
  SchedulerProbe(runtime::Context<tile_scheduler::Inbox> context, std::vector<tile_scheduler::FrameDone>* done)
      : Actor(std::move(context)), done_(done) {}
  void on(tile_scheduler::FrameDone&& m) { done_->push_back(m); }
  template <class M>
  void on(M&&) {}

 private:
  std::vector<tile_scheduler::FrameDone>* done_;
};

std::shared_ptr<const TileImage> grey_tile(std::uint8_t level) {
  auto image = std::make_shared<TileImage>();
  image->rgb.fill(level);
  image->y.fill(level);
  image->cb.fill(128);
  image->cr.fill(128);
  return image;
}

ComposeFrame compose(FrameNumber number, bool key, SlotIndex slot = 0) {
  ComposeFrame c(number, key);
  c.writes.push_back({slot, grey_tile(static_cast<std::uint8_t>(50 + number))});
  c.edits.push_back({TileId(0, 5), slot, nullptr, nullptr});
  c.error = 0.25f;
  ViewAnswer answer;
  answer.session = SessionId{2};
  answer.sequence = 40 + number;
  answer.stamps.client_sent = 7;
  c.answers.push_back(answer);
  c.errors.push_back({SessionId{2}, 0.125f});
  return c;
}

class EncoderActorTest : public ::testing::Test {
 protected:
  runtime::Ref<Inbox> start(EncoderOptions options) {
    options.stream = StreamId{9};
    for (int i = 0; i < 2; ++i) {
      sessions.push_back(system.spawn<SessionProbe>("session/" + std::to_string(i + 1), 100, &seen[i]));
    }
    auto receivers = [this] {
      return std::vector<std::pair<SessionId, runtime::Ref<session::Inbox>>>{{SessionId{1}, sessions[0]},
                                                                             {SessionId{2}, sessions[1]}};
    };
    auto scheduler = system.spawn<SchedulerProbe>("tile_scheduler", 100, &done);
    return system.spawn<EncoderActor>("encoder/9", 16, options, receivers, scheduler, runtime::null_metrics());
  }
  static EncoderOptions small() {
    EncoderOptions o;
    o.phystex_size = 64;
    return o;
  }

  SessionProbe::Seen seen[2];
  std::vector<tile_scheduler::FrameDone> done;
  runtime::DeterministicSystem system;
  std::vector<runtime::Ref<session::Inbox>> sessions;
};

TEST_F(EncoderActorTest, one_picture_reaches_every_session_with_its_own_answer) {
  auto encoder = start(small());
  ASSERT_TRUE(encoder.tell(compose(1, true)));
  system.run_until_idle();
  ASSERT_EQ(seen[0].frames.size(), 1u);
  ASSERT_EQ(seen[1].frames.size(), 1u);
  const auto& first = seen[0].frames[0];
  const auto& second = seen[1].frames[0];
  EXPECT_EQ(first.frame, second.frame);  // shared, not copied
  EXPECT_EQ(first.frame->stream, StreamId{9});
  EXPECT_TRUE(first.frame->key);
  EXPECT_FALSE(first.frame->h264.empty());
  EXPECT_EQ(first.frame->edits.size(), 1u);
  EXPECT_FLOAT_EQ(first.frame->error, 0.25f);
  EXPECT_EQ(first.answer.sequence, 0u);
  EXPECT_EQ(first.answer.session, SessionId{1});
  EXPECT_FLOAT_EQ(first.answer.error, 0.25f) << "the stream's";
  EXPECT_FLOAT_EQ(second.answer.error, 0.125f) << "its own";
  EXPECT_EQ(second.answer.sequence, 41u);
  EXPECT_EQ(second.answer.stamps.client_sent, 7);
  EXPECT_LE(second.answer.stamps.encode_started, second.answer.stamps.picture_composed);
  EXPECT_LE(second.answer.stamps.picture_composed, second.answer.stamps.encoded);
  ASSERT_EQ(done.size(), 1u);
  EXPECT_TRUE(done[0].ok);
  EXPECT_EQ(done[0].stream, StreamId{9});
}

TEST_F(EncoderActorTest, frames_stay_in_order) {
  auto encoder = start(small());
  for (FrameNumber n = 1; n <= 5; ++n) {
    ASSERT_TRUE(encoder.tell(compose(n, n == 1)));
    system.run_until_idle();
  }
  ASSERT_EQ(seen[0].frames.size(), 5u);
  for (FrameNumber n = 1; n <= 5; ++n) EXPECT_EQ(seen[0].frames[n - 1].frame->frame, n);
}

TEST_F(EncoderActorTest, a_lossless_stream_sends_tiles_as_they_are) {
  auto options = small();
  options.lossless_rgb = true;
  auto encoder = start(options);
  ASSERT_TRUE(encoder.tell(compose(1, true, 3)));
  system.run_until_idle();
  ASSERT_EQ(seen[0].frames.size(), 1u);
  const auto& frame = *seen[0].frames[0].frame;
  EXPECT_TRUE(frame.h264.empty());
  ASSERT_EQ(frame.lossless.size(), 1u);
  EXPECT_EQ(frame.lossless[0].slot, 3);
  EXPECT_EQ(frame.lossless[0].image->rgb[0], 51);
}

TEST_F(EncoderActorTest, a_key_frame_for_a_slow_link_is_coarser_and_smaller) {
  const auto noise = [](FrameNumber number, std::size_t most_bytes) {
    auto command = compose(number, true);
    auto image = std::make_shared<TileImage>(*grey_tile(0));
    for (std::size_t i = 0; i < image->y.size(); ++i) image->y[i] = static_cast<std::uint8_t>(i * i * 31 % 251);
    command.writes = {{0, image}, {1, image}, {2, image}, {3, image}};
    command.most_bytes = most_bytes;
    return command;
  };
  auto encoder = start(small());
  encoder.tell(noise(1, 0));
  system.run_until_idle();
  ASSERT_EQ(done.size(), 1u);
  EXPECT_FALSE(done[0].limited);
  const auto whole = seen[0].frames[0].frame->h264.size();
  EXPECT_GE(done[0].bytes, whole);
  encoder.tell(noise(2, whole / 3));
  system.run_until_idle();
  ASSERT_EQ(done.size(), 2u);
  EXPECT_TRUE(done[1].limited);
  EXPECT_TRUE(done[1].key);
  EXPECT_FALSE(done[1].settled);
  EXPECT_LT(seen[0].frames[1].frame->h264.size(), whole / 2);
}

TEST_F(EncoderActorTest, after_a_failure_only_a_key_frame_goes_on) {
  auto encoder = start(small());
  encoder.tell(compose(1, true));
  system.run_until_idle();
  encoder.tell(compose(2, false, 999));  // no such slot
  system.run_until_idle();
  encoder.tell(compose(3, false));  // refused: its table builds on frame 2
  system.run_until_idle();
  encoder.tell(compose(4, true));
  system.run_until_idle();
  ASSERT_EQ(done.size(), 4u);
  EXPECT_TRUE(done[0].ok);
  EXPECT_FALSE(done[1].ok);
  EXPECT_FALSE(done[2].ok);
  EXPECT_TRUE(done[3].ok);
  ASSERT_EQ(seen[0].frames.size(), 2u);
  EXPECT_EQ(seen[0].frames[1].frame->frame, 4u);
}

TEST_F(EncoderActorTest, a_codec_that_cannot_open_is_reported_not_fatal) {
  auto options = small();
  options.preset = "nonsense";
  auto encoder = start(options);
  encoder.tell(compose(1, true));
  system.run_until_idle();
  ASSERT_EQ(done.size(), 1u);
  EXPECT_FALSE(done[0].ok);
  EXPECT_TRUE(system.failures().empty());
}

TEST_F(EncoderActorTest, a_scheduler_that_is_too_busy_hears_of_the_frame_later) {
  auto options = small();
  options.stream = StreamId{9};
  const auto scheduler = system.spawn<SchedulerProbe>("tile_scheduler", 1, &done);
  auto nobody = [&] {  // asked for just before the scheduler is told
    EXPECT_TRUE(scheduler.tell(tile_scheduler::ViewTraced(1))) << "its mailbox is full now";
    return std::vector<std::pair<SessionId, runtime::Ref<session::Inbox>>>();
  };
  auto encoder = system.spawn<EncoderActor>("encoder/9", 16, options, nobody, scheduler, runtime::null_metrics());
  encoder.tell(compose(1, true));
  system.run_until_idle();
  EXPECT_TRUE(done.empty());
  system.advance(std::chrono::milliseconds(100));
  ASSERT_EQ(done.size(), 1u);
  EXPECT_TRUE(done[0].ok);
}

std::shared_ptr<const CoarsePicture> coarse_noise(std::uint32_t version, std::uint32_t size) {
  auto p = std::make_shared<CoarsePicture>();
  p->version = version;
  p->width = size;
  p->height = size;
  p->rgb.resize(std::size_t{size} * size * 3);
  std::uint32_t state = version;
  for (auto& c : p->rgb) c = static_cast<std::uint8_t>((state = state * 1664525u + 1013904223u) >> 24);
  return p;
}

TEST(CoarseEncoderActor, sends_the_newest_still_to_all_and_to_who_asks) {
  SessionProbe::Seen seen[2];
  runtime::DeterministicSystem system;
  auto registry = std::make_shared<SessionRegistry>();
  registry->add(SessionId{1}, system.spawn<SessionProbe>("session/1", 100, &seen[0]));
  auto coarse =
      system.spawn<CoarseEncoderActor>("coarse_encoder", 16, registry, CoarseStillOptions{}, runtime::null_metrics());
  coarse.tell(CoarseWanted(SessionId{1}));  // nothing there yet
  coarse.tell(CoarseShaded(coarse_noise(1, 40)));
  system.run_until_idle();
  EXPECT_EQ(seen[0].coarse_versions, std::vector<std::uint32_t>{1});
  registry->add(SessionId{2}, system.spawn<SessionProbe>("session/2", 100, &seen[1]));
  coarse.tell(CoarseWanted(SessionId{2}));
  coarse.tell(CoarseWanted(SessionId{77}));  // gone: nobody to tell
  system.run_until_idle();
  EXPECT_EQ(seen[1].coarse_versions, std::vector<std::uint32_t>{1});
  EXPECT_EQ(seen[0].coarse_versions.size(), 1u);
  coarse.tell(CoarseShaded(coarse_noise(2, 40)));
  system.run_until_idle();
  EXPECT_EQ(seen[0].coarse_versions.back(), 2u);
  EXPECT_EQ(seen[1].coarse_versions.back(), 2u);
}

TEST(CoarseStill, gives_up_quality_to_stay_within_its_bytes) {
  const auto picture = coarse_noise(1, 256);
  CoarseStillOptions options;
  options.max_bytes = 1'000'000'000;
  const auto full = encode_coarse(*picture, options).value()->h264.size();
  options.max_bytes = full / 2;
  EXPECT_LE(encode_coarse(*picture, options).value()->h264.size(), full / 2);
  CoarsePicture wrong = *picture;
  wrong.rgb.pop_back();
  EXPECT_FALSE(encode_coarse(wrong, options).has_value());
}

}  // namespace
}  // namespace darm::encoder
