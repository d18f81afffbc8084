#include "actors/session/send_queue.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <tuple>

namespace darm::session {
namespace {

Packet bytes(std::size_t n) {
  Packet p;
  p.head.resize(n);
  return p;
}

std::shared_ptr<const EncodedFrame> picture(FrameNumber number, bool key, std::size_t size = 100) {
  auto f = std::make_shared<EncodedFrame>();
  f->frame = number;
  f->key = key;
  f->h264.resize(size);
  return f;
}

ViewAnswer answer(CameraSequence sequence) {
  ViewAnswer a;
  a.sequence = sequence;
  return a;
}

std::size_t dropped(const SendQueue& q) { return std::accumulate(q.drops().begin(), q.drops().end(), std::size_t{0}); }

// Takes writes and remembers which pictures and answers went out.
struct Taker {
  std::vector<FrameNumber> frames;
  std::vector<CameraSequence> answers;
  // The sizes of the messages of one write.
  std::vector<std::size_t> sizes(SendQueue& q, Microseconds now = 0) {
    std::vector<std::size_t> out;
    for (const auto& p : take(q, now)) out.push_back(p.size());
    return out;
  }
  Packets take(SendQueue& q, Microseconds now) {
    return q.take(
        now,
        [this](const auto& f, const ViewAnswer& a) {
          frames.push_back(f->frame);
          answers.push_back(a.sequence);
          return bytes(1);
        },
        [this](const NoChange& e) {
          answers.push_back(e.answer.sequence);
          return bytes(1);
        });
  }
};

TEST(SendQueue, starts_with_a_key_frame) {
  SendQueue q{SendLimits{}};
  EXPECT_FALSE(q.push_picture(picture(1, false), answer(0), 0));
  EXPECT_TRUE(q.ask_for_key(0));
  EXPECT_FALSE(q.ask_for_key(10));  // asked a moment ago
  EXPECT_TRUE(q.push_picture(picture(2, true), answer(0), 20));
  EXPECT_TRUE(q.push_picture(picture(3, false), answer(0), 30));
  EXPECT_FALSE(q.ask_for_key(5'000'000));
}

TEST(SendQueue, the_layers_lose_pictures_each_for_itself) {
  const auto own = [](FrameNumber number, bool key) {
    auto f = std::make_shared<EncodedFrame>();
    f->layer = StreamLayer::kView;
    f->frame = number;
    f->key = key;
    f->h264.resize(100);
    return f;
  };
  SendQueue q{SendLimits{}};
  EXPECT_FALSE(q.ask_for_key(0, StreamLayer::kView)) << "a private layer may never begin";
  EXPECT_TRUE(q.push_picture(picture(1, true), answer(1), 0));
  EXPECT_FALSE(q.push_picture(own(5, false), answer(0), 0));
  EXPECT_TRUE(q.ask_for_key(1, StreamLayer::kView));
  EXPECT_FALSE(q.ask_for_key(1));
  EXPECT_TRUE(q.push_picture(own(6, true), answer(0), 2));
  // Too old by now: the private pictures go, the shared ones as well when their own next one comes, not before.
  EXPECT_FALSE(q.push_picture(own(7, false), answer(0), 900'000));
  EXPECT_EQ(dropped(q), 3u);
  EXPECT_TRUE(q.push_picture(own(8, true), answer(0), 900'001));
  Taker taker;
  while (!taker.take(q, 900'002).empty()) q.sent(0);
  EXPECT_EQ(taker.frames, (std::vector<FrameNumber>{1, 8}));
  EXPECT_EQ(taker.answers, (std::vector<CameraSequence>{1, 0}));
}

std::shared_ptr<const EncodedFrame> of_stream(std::uint32_t stream, FrameNumber number, bool key) {
  auto f = std::make_shared<EncodedFrame>(*picture(number, key));
  f->stream = StreamId{stream};
  return f;
}

TEST(SendQueue, of_another_stream_no_picture_is_sent_before_its_key_frame) {
  SendQueue q{SendLimits{}};
  Taker taker;
  EXPECT_TRUE(q.push_picture(of_stream(1, 5, true), answer(1), 0));
  taker.take(q, 0);
  q.sent(0);
  EXPECT_FALSE(q.push_picture(of_stream(2, 6, false), answer(2), 10)) << "though its number would follow";
  EXPECT_FALSE(q.ask_for_key(10)) << "whoever comes to a stream is made one";
  EXPECT_TRUE(q.push_picture(of_stream(2, 7, true), answer(0), 20));
  EXPECT_TRUE(q.push_picture(of_stream(2, 8, false), answer(3), 30));
  EXPECT_FALSE(q.push_picture(of_stream(1, 6, false), answer(0), 31)) << "a late one of the stream before";
  EXPECT_TRUE(q.push_picture(of_stream(2, 9, false), answer(0), 40)) << "it does no harm";
  while (!taker.take(q, 50).empty()) q.sent(0);
  EXPECT_EQ(taker.frames, (std::vector<FrameNumber>{5, 7, 8, 9}));
  EXPECT_EQ(taker.answers, (std::vector<CameraSequence>{1, 2, 3, 0})) << "no answer is lost";
}

TEST(SendQueue, who_comes_back_to_a_stream_needs_its_key_frame_too) {
  SendQueue q{SendLimits{}};
  EXPECT_TRUE(q.push_picture(of_stream(1, 5, true), answer(0), 0));
  EXPECT_FALSE(q.push_picture(of_stream(2, 9, false), answer(0), 1));
  EXPECT_FALSE(q.push_picture(of_stream(1, 8, false), answer(0), 2)) << "6 and 7 went to others";
  EXPECT_TRUE(q.push_picture(of_stream(1, 9, true), answer(0), 3));
}

TEST(SendQueue, the_key_frame_of_another_stream_replaces_what_waits) {
  SendQueue q{SendLimits{}};
  Taker taker;
  EXPECT_TRUE(q.push_picture(of_stream(1, 5, true), answer(1), 0));
  EXPECT_TRUE(q.push_picture(of_stream(1, 6, false), answer(2), 0));
  EXPECT_TRUE(q.push_picture(of_stream(2, 3, true), answer(0), 1));
  while (!taker.take(q, 2).empty()) q.sent(0);
  EXPECT_EQ(taker.frames, std::vector<FrameNumber>{3});
  EXPECT_EQ(taker.answers, std::vector<CameraSequence>{2});
}

TEST(SendQueue, a_key_frame_of_the_new_stream_that_does_not_come_is_asked_for) {
  SendQueue q{SendLimits{}};
  EXPECT_FALSE(q.push_picture(of_stream(1, 5, false), answer(0), 0)) << "a late joiner has none at all";
  EXPECT_FALSE(q.ask_for_key(0));
  EXPECT_FALSE(q.push_picture(of_stream(1, 6, false), answer(0), 999'999));
  EXPECT_FALSE(q.ask_for_key(999'999));
  EXPECT_FALSE(q.push_picture(of_stream(1, 7, false), answer(0), 1'000'000));
  EXPECT_TRUE(q.ask_for_key(1'000'000));
  EXPECT_TRUE(q.push_picture(of_stream(1, 8, true), answer(0), 1'000'001));
}

TEST(SendQueue, a_key_frame_turned_away_for_geometry_is_asked_for_again_at_once) {
  SendQueue q{SendLimits{}};
  Taker taker;
  q.push_bulk(bytes(5));
  EXPECT_FALSE(q.push_picture(of_stream(1, 5, false), answer(0), 0));
  EXPECT_FALSE(q.push_picture(of_stream(1, 6, true), answer(0), 1));
  taker.take(q, 2);
  q.sent(0);
  EXPECT_TRUE(q.ask_for_key(2));
}

using Sizes = std::vector<std::size_t>;

TEST(SendQueue, one_write_at_a_time_in_order) {
  SendQueue q{SendLimits{}};
  Taker t;
  q.push_control(bytes(3));
  q.push_bulk(bytes(5));
  EXPECT_EQ(t.sizes(q), (Sizes{3, 5}));
  q.push_bulk(bytes(7));
  EXPECT_EQ(t.sizes(q), Sizes{});
  q.sent(0);
  EXPECT_EQ(t.sizes(q), Sizes{7});
  q.sent(0);
  EXPECT_TRUE(q.idle());
}

// A turn of the session costs tens of milliseconds on a busy machine: 120 chunks one a turn took 3.7 s.
TEST(SendQueue, a_write_holds_as_many_messages_as_its_bytes_allow) {
  SendLimits limits;
  limits.write_bytes = 100;
  SendQueue q{limits};
  Taker t;
  for (const std::size_t size : {40, 40, 40, 250, 60, 40, 1}) q.push_bulk(bytes(size));
  std::vector<Sizes> writes;
  for (auto write = t.sizes(q); !write.empty(); write = t.sizes(q)) {
    writes.push_back(write);
    q.sent(0);
  }
  EXPECT_EQ(writes, (std::vector<Sizes>{{40, 40}, {40}, {250}, {60, 40}, {1}}));
}

TEST(SendQueue, control_messages_pass_between_the_writes_of_geometry) {
  SendLimits limits;
  limits.write_bytes = 100;
  SendQueue q{limits};
  Taker t;
  for (int i = 0; i < 10; ++i) q.push_bulk(bytes(50));
  EXPECT_EQ(t.sizes(q), (Sizes{50, 50}));
  q.push_control(bytes(3));
  q.push_coarse(bytes(80));
  q.sent(0);
  EXPECT_EQ(t.sizes(q), (Sizes{3, 80}));
  q.sent(0);
  EXPECT_EQ(t.sizes(q), (Sizes{50, 50}));
}

TEST(SendQueue, pictures_and_the_background_take_turns) {
  SendLimits limits;
  limits.background_bytes = 20;
  SendQueue q{limits};
  Taker t;
  q.push_bulk(bytes(50));
  for (int i = 0; i < 6; ++i) q.push_background(bytes(10));
  EXPECT_EQ(t.sizes(q), Sizes{50}) << "what the first picture needs";
  q.sent(0);
  EXPECT_TRUE(q.push_picture(picture(1, true), answer(0), 0)) << "though there is geometry left";
  EXPECT_TRUE(q.push_picture(picture(2, false), answer(0), 0));
  q.push_control(bytes(3));
  EXPECT_EQ(t.sizes(q), Sizes{1});
  q.sent(0);
  EXPECT_EQ(t.sizes(q), (Sizes{10, 10})) << "a stream that fills the line does not keep geometry out";
  q.sent(0);
  EXPECT_EQ(t.sizes(q), Sizes{1});
  q.sent(0);
  EXPECT_EQ(t.sizes(q), Sizes{3}) << "control messages wait for nobody";
  for (int i = 0; i < 2; ++i) {
    q.sent(0);
    EXPECT_EQ(t.sizes(q), (Sizes{10, 10}));
  }
  q.sent(0);
  EXPECT_TRUE(q.idle());
  EXPECT_EQ(t.frames, (std::vector<FrameNumber>{1, 2}));
}

TEST(SendQueue, pictures_wait_until_the_geometry_is_out) {
  SendQueue q{SendLimits{}};
  Taker t;
  q.push_bulk(bytes(5));
  EXPECT_FALSE(q.push_picture(picture(1, true), answer(9), 0));
  EXPECT_FALSE(q.ask_for_key(0));
  t.take(q, 0);
  q.sent(0);
  EXPECT_TRUE(q.ask_for_key(0));
  EXPECT_TRUE(q.push_picture(picture(2, true), answer(0), 0));
  t.take(q, 0);
  EXPECT_EQ(t.answers, std::vector<CameraSequence>{9});  // the dropped picture's answer was not lost
}

TEST(SendQueue, what_waits_too_long_goes_with_all_that_builds_on_it) {
  SendLimits limits;
  limits.media_age = 100;
  SendQueue q{limits};
  Taker t;
  q.push_control(bytes(1));
  t.take(q, 0);  // keeps the socket busy
  EXPECT_TRUE(q.push_picture(picture(1, true), answer(1), 0));
  EXPECT_TRUE(q.push_picture(picture(2, false), answer(2), 50));
  EXPECT_FALSE(q.push_picture(picture(3, false), answer(3), 101));
  EXPECT_EQ(dropped(q), 3u);
  q.sent(0);
  EXPECT_TRUE(q.ask_for_key(102));
  EXPECT_TRUE(q.push_picture(picture(4, true), answer(0), 103));
  t.take(q, 104);
  EXPECT_EQ(t.frames, std::vector<FrameNumber>{4});
  EXPECT_EQ(t.answers, std::vector<CameraSequence>{3});
}

TEST(SendQueue, a_single_picture_may_be_of_any_size) {
  SendLimits limits;
  limits.media_bytes = 50;
  SendQueue q{limits};
  EXPECT_TRUE(q.push_picture(picture(1, true, 1000), answer(0), 0));
  EXPECT_FALSE(q.push_picture(picture(2, false, 1000), answer(0), 0));
}

TEST(SendQueue, no_change_waits_for_the_key_frame) {
  SendQueue q{SendLimits{}};
  Taker t;
  q.push_no_change(NoChange(answer(5), 0));
  EXPECT_TRUE(t.take(q, 0).empty());
  q.push_picture(picture(1, true), answer(4), 0);
  q.push_no_change(NoChange(answer(6), 0));
  t.take(q, 0);
  q.sent(0);
  t.take(q, 0);
  EXPECT_EQ(t.answers, (std::vector<CameraSequence>{5, 6}));
}

TEST(SendQueue, notices_a_client_that_does_not_read) {
  SendLimits limits;
  limits.grace = 1000;
  SendQueue q{limits};
  Taker t;
  q.push_control(bytes(1));
  t.take(q, 0);
  EXPECT_FALSE(q.too_slow(1000));
  EXPECT_TRUE(q.too_slow(1001));
}

// Whatever happens, what leaves the queue is a chain a decoder can follow: no picture follows a gap but a key frame.
TEST(SendQueue, never_sends_a_picture_after_a_gap) {
  std::mt19937 random(5);
  for (int run = 0; run < 200; ++run) {
    SendLimits limits;
    limits.media_age = 30;
    limits.media_bytes = 500;
    SendQueue q{limits};
    std::vector<std::tuple<FrameNumber, bool, StreamId>> out;
    Microseconds now = 0;
    bool busy = false;
    bool want_key = false;
    std::uint32_t stream = 1;
    for (FrameNumber n = 1; n < 200; ++n) {
      now += random() % 20;
      const bool key = want_key || random() % 20 == 0;
      want_key = false;
      if (random() % 30 == 0) stream = 1 + static_cast<std::uint32_t>(random() % 3);
      auto f = std::make_shared<EncodedFrame>(*picture(n, key, 50 + random() % 200));
      f->stream = StreamId{stream};
      q.push_picture(f, answer(0), now);
      if (random() % 10 == 0) q.require_key();
      if (random() % 30 == 0) q.push_bulk(bytes(1));
      if (random() % 10 == 0) q.push_background(bytes(1));
      if (q.ask_for_key(now)) want_key = true;
      if (busy && random() % 3 == 0) {
        q.sent(0);
        busy = false;
      }
      if (!busy) {
        busy = !q.take(
                     now,
                     [&](const auto& taken, const ViewAnswer&) {
                       out.emplace_back(taken->frame, taken->key, taken->stream);
                       return bytes(1);
                     },
                     [](const NoChange&) { return bytes(1); })
                    .empty();
      }
    }
    FrameNumber last = 0;
    StreamId of{};
    for (const auto& [number, key, from] : out) {
      ASSERT_TRUE(key || (number == last + 1 && from == of)) << "frame " << number << " after " << last;
      last = number;
      of = from;
    }
  }
}

TEST(SendQueue, what_a_key_frame_takes_on_a_slow_line_does_not_age_what_follows_it) {
  SendQueue q{SendLimits{}};
  Taker taker;
  EXPECT_TRUE(q.push_picture(picture(1, true, 1'000'000), answer(0), 0));
  taker.take(q, 0);
  EXPECT_TRUE(q.push_picture(picture(2, false), answer(0), 100'000));
  EXPECT_TRUE(q.push_picture(picture(3, false), answer(0), 2'900'000)) << "the key frame is still on its way";
  q.sent(3'000'000);
  EXPECT_TRUE(q.push_picture(picture(4, false), answer(0), 3'400'000));
  taker.take(q, 3'400'000);
  EXPECT_FALSE(q.push_picture(picture(5, false), answer(0), 3'600'000)) << "but then it counts";
  EXPECT_EQ(q.overdue(), 2u);
}

TEST(SendQueue, every_drop_has_its_reason) {
  SendQueue q{SendLimits{}};
  const auto counted = [&](Drop why) { return q.drops()[static_cast<std::size_t>(why)]; };
  q.push_bulk(bytes(10));
  EXPECT_FALSE(q.push_picture(picture(1, true), answer(0), 0));
  EXPECT_EQ(counted(Drop::kLoading), 1u);
  Taker taker;
  taker.take(q, 0);
  q.sent(0);
  EXPECT_FALSE(q.push_picture(picture(2, false), answer(0), 0));
  EXPECT_EQ(counted(Drop::kKeyNeeded), 1u);
  EXPECT_TRUE(q.push_picture(picture(3, true), answer(0), 0));
  EXPECT_TRUE(q.push_picture(picture(4, true), answer(0), 1));
  EXPECT_EQ(counted(Drop::kReplaced), 1u);
  EXPECT_FALSE(q.push_picture(picture(5, false, 5u << 20), answer(0), 2));
  EXPECT_EQ(counted(Drop::kFull), 1u);
  EXPECT_TRUE(q.push_picture(picture(6, true), answer(0), 3));
  EXPECT_FALSE(q.push_picture(picture(7, false), answer(0), 900'000));
  EXPECT_EQ(counted(Drop::kOld), 1u);
  EXPECT_TRUE(q.push_picture(of_stream(1, 8, true), answer(0), 900'001));
  EXPECT_FALSE(q.push_picture(of_stream(2, 9, false), answer(0), 900'002));
  EXPECT_EQ(counted(Drop::kElsewhere), 1u);
  EXPECT_EQ(q.overdue(), 2u) << "the others are no sign of a client that does not keep up";
}

TEST(SendQueue, the_background_waits_for_room) {
  SendQueue q{SendLimits{}};
  q.push_background(bytes(10));
  const auto none = [](const auto&...) { return Packet{}; };
  EXPECT_TRUE(q.take(0, none, none, false).empty());
  EXPECT_EQ(q.take(0, none, none, true).size(), 1u);
}

}  // namespace
}  // namespace darm::session
