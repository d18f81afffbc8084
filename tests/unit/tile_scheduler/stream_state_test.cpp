#include "actors/tile_scheduler/stream_state.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tests/unit/tile_scheduler/random.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr SessionId kSession{7};

struct Images {
  std::map<TileId, StoredImage> stored;
  void put(TileId tile, std::uint32_t version) {
    StoredImage s;
    s.version = version;
    auto image = std::make_shared<TileImage>();
    image->y[0] = static_cast<std::uint8_t>(version);
    s.image = image;
    stored[tile] = s;
  }
  [[nodiscard]] ImageLookup lookup() const {
    return [this](TileId t) {
      const auto it = stored.find(t);
      return it == stored.end() ? nullptr : &it->second;
    };
  }
};

// A client: applies edits and pictures of the frames that reach it.
struct Client {
  std::map<TileId, SlotIndex> table;
  std::map<SlotIndex, std::shared_ptr<const TileImage>> slots;
  void apply(const encoder::ComposeFrame& frame) {
    if (frame.key) table.clear();
    for (const auto& e : frame.edits) {
      if (e.slot == kNoSlot) {
        table.erase(e.tile);
      } else {
        table[e.tile] = e.slot;
      }
    }
    for (const auto& w : frame.writes) slots[w.slot] = w.image;
  }
};

ViewAnswer answer(CameraSequence sequence) {
  ViewAnswer a;
  a.session = kSession;
  a.sequence = sequence;
  return a;
}

StreamFormat small() {
  StreamFormat f;
  f.phystex_size = 128;  // 16 slots
  return f;
}

TEST(StreamState, ClientTableEqualsTheServersWhateverFramesAreLost) {
  testing::Random rng(3);
  for (int round = 0; round < 20; ++round) {
    StreamOptions options;
    options.max_writes = 1 + rng() % 12;
    StreamState stream(small(), options);
    Images images;
    Client client;
    bool client_lost = true;
    for (Microseconds now = 0; now < 400; ++now) {
      for (int i = 0; i < 4; ++i)
        images.put(TileId(int(rng() % 2), rng() % 20), static_cast<std::uint32_t>(rng() % 200));
      std::vector<TileId> wanted;
      for (std::uint32_t i = 0; i < 20; ++i)
        if (rng() % 2 == 0) wanted.emplace_back(int(i % 2), i);
      auto step = stream.step(wanted, images.lookup(), 0, now);
      if (!step.frame) continue;
      ASSERT_TRUE(step.frame->key || step.frame->writes.size() <= options.max_writes);
      const bool encoder_fails = rng() % 10 == 0;
      const bool network_loses = rng() % 10 == 0;
      stream.frame_done(step.frame->frame, !encoder_fails);
      if (encoder_fails || network_loses) {
        client_lost = true;
        stream.want_key();
        continue;
      }
      if (step.frame->key) client_lost = false;
      ASSERT_FALSE(client_lost) << "no key frame after a loss";
      client.apply(*step.frame);
      ASSERT_EQ(client.table.size(), stream.table().size());
      for (const auto& [tile, slot] : client.table) {
        ASSERT_EQ(stream.table().slot_of(tile), slot);
        ASSERT_TRUE(client.slots.contains(slot)) << "a slot without pixels is in the table";
      }
    }
  }
}

TEST(StreamState, ATileComesWithItsPixelsInTheSameFrame) {
  StreamState stream(small(), {});
  Images images;
  const std::vector<TileId> wanted{TileId(0, 4), TileId(1, 5)};
  images.put(TileId(1, 5), 1);
  auto step = stream.step(wanted, images.lookup(), 0, 0);
  ASSERT_TRUE(step.frame);
  ASSERT_EQ(step.frame->edits.size(), 1u);
  ASSERT_EQ(step.frame->writes.size(), 1u);
  EXPECT_EQ(step.frame->edits[0].tile, TileId(1, 5));
  EXPECT_EQ(step.frame->edits[0].slot, step.frame->writes[0].slot);
  EXPECT_EQ(step.frame->writes[0].image, images.stored[TileId(1, 5)].image);
}

TEST(StreamState, SendsOneFrameAtATimeAndOnlyWhatChanged) {
  StreamState stream(small(), {});
  Images images;
  const std::vector<TileId> wanted{TileId(0, 1), TileId(0, 2)};
  images.put(wanted[0], 1);
  images.put(wanted[1], 1);
  auto first = stream.step(wanted, images.lookup(), 0, 0);
  ASSERT_TRUE(first.frame);
  EXPECT_TRUE(first.frame->key);
  images.put(wanted[1], 2);
  EXPECT_FALSE(stream.step(wanted, images.lookup(), 0, 1).frame) << "the first frame is still in flight";
  stream.frame_done(first.frame->frame, true);
  auto second = stream.step(wanted, images.lookup(), 0, 2);
  ASSERT_TRUE(second.frame);
  EXPECT_FALSE(second.frame->key);
  EXPECT_EQ(second.frame->frame, first.frame->frame + 1);
  EXPECT_EQ(second.frame->writes.size(), 1u);
  EXPECT_TRUE(second.frame->edits.empty());
}

TEST(StreamState, AnswersACameraOnceByFrameOrByNoChange) {
  StreamState stream(small(), {});
  Images images;
  stream.view_ready(answer(1));
  auto first = stream.step({}, images.lookup(), 0.5f, 10);
  ASSERT_TRUE(first.frame);
  ASSERT_EQ(first.frame->answers.size(), 1u);
  EXPECT_EQ(first.frame->answers[0].stamps.composed, 10);
  EXPECT_EQ(first.frame->error, 0.5f);
  stream.frame_done(1, true);
  stream.view_ready(answer(2));
  auto second = stream.step({}, images.lookup(), 0, 20);
  EXPECT_FALSE(second.frame);
  ASSERT_EQ(second.no_change.size(), 1u);
  EXPECT_EQ(second.no_change[0].sequence, 2u);
  auto third = stream.step({}, images.lookup(), 0, 30);
  EXPECT_FALSE(third.frame);
  EXPECT_TRUE(third.no_change.empty());
}

TEST(StreamState, a_picture_that_is_not_settled_is_coded_again_though_nothing_changes) {
  StreamOptions options;
  options.polish_interval = 100;
  StreamState stream(small(), options);
  Images images;
  const std::vector<TileId> wanted{TileId(0, 1)};
  images.put(wanted[0], 1);
  const auto first = stream.step(wanted, images.lookup(), 0.1f, 0);
  ASSERT_TRUE(first.frame);
  stream.frame_done(first.frame->frame, true, false);
  EXPECT_FALSE(stream.step(wanted, images.lookup(), 0.1f, 99).frame);
  const auto again = stream.step(wanted, images.lookup(), 0.1f, 100);
  ASSERT_TRUE(again.frame);
  EXPECT_FALSE(again.frame->key);
  EXPECT_TRUE(again.frame->writes.empty());
  stream.frame_done(again.frame->frame, true, true);
  EXPECT_FALSE(stream.step(wanted, images.lookup(), 0.1f, 1000).frame);
}

TEST(StreamState, AFailedFrameIsAnsweredAgainByAKeyFrame) {
  StreamState stream(small(), {});
  Images images;
  stream.view_ready(answer(1));
  auto first = stream.step({}, images.lookup(), 0, 0);
  stream.frame_done(first.frame->frame, false);
  auto second = stream.step({}, images.lookup(), 0, 1);
  ASSERT_TRUE(second.frame);
  EXPECT_TRUE(second.frame->key);
  ASSERT_EQ(second.frame->answers.size(), 1u);
  EXPECT_EQ(second.frame->answers[0].sequence, 1u);
}

// A hundred streams once made a thousand key frames in a minute: theirs had only waited in the encoder's queue.
TEST(StreamState, AFrameIsWaitedForHoweverLongItTakes) {
  StreamState stream(small(), {});
  Images images;
  ASSERT_TRUE(stream.step({}, images.lookup(), 0, 0).frame);
  EXPECT_FALSE(stream.step({}, images.lookup(), 0, 3'600'000'000).frame);
  EXPECT_TRUE(stream.in_flight());
}

TEST(StreamState, AFrameGoesWithItsEncoder) {
  StreamState stream(small(), {});
  Images images;
  ASSERT_TRUE(stream.step({}, images.lookup(), 0, 0).frame);
  stream.encoder_gone();
  auto again = stream.step({}, images.lookup(), 0, 1);
  ASSERT_TRUE(again.frame);
  EXPECT_TRUE(again.frame->key);
  stream.frame_done(1, true);
  EXPECT_TRUE(stream.in_flight()) << "a late report of the lost frame ends nothing";
}

TEST(StreamState, ASessionThatGoesTakesWhatItWasNotAnswered) {
  StreamState stream(small(), {});
  Images images;
  const auto answer = [](std::uint64_t session, CameraSequence sequence) {
    ViewAnswer a;
    a.session = SessionId{session};
    a.sequence = sequence;
    return a;
  };
  stream.view_ready(answer(1, 4));
  stream.view_ready(answer(2, 7));
  ASSERT_EQ(stream.step({}, images.lookup(), 0, 0).frame->answers.size(), 2u);
  stream.view_ready(answer(2, 8));
  EXPECT_EQ(stream.forget_session(SessionId{1})->sequence, 4u) << "in a frame that it may not get";
  EXPECT_EQ(stream.forget_session(SessionId{2})->sequence, 8u);
  EXPECT_FALSE(stream.forget_session(SessionId{2}));
  stream.frame_done(1, false);
  EXPECT_TRUE(stream.step({}, images.lookup(), 0, 1).frame->answers.empty());
}

TEST(StreamState, NewTilesComeBeforeRefinementsWithinTheLimit) {
  StreamOptions options;
  options.max_writes = 2;
  StreamState stream(small(), options);
  Images images;
  std::vector<TileId> wanted{TileId(0, 1), TileId(0, 2)};
  images.put(wanted[0], 1);
  images.put(wanted[1], 1);
  stream.frame_done(stream.step(wanted, images.lookup(), 0, 0).frame->frame, true);
  images.put(wanted[0], 2);
  for (std::uint32_t i = 3; i < 6; ++i) {
    wanted.emplace_back(0, i);
    images.put(wanted.back(), 1);
  }
  const auto next = stream.step(wanted, images.lookup(), 0, 1);
  ASSERT_EQ(next.frame->writes.size(), 2u);
  EXPECT_EQ(next.frame->edits.size(), 2u);
}

// Whatever was wanted before: so many updates, and no more, until everything is there that is still wanted.
TEST(StreamState, EachTileThatStaysWantedIsThereAfterSlotsOverWritesUpdates) {
  for (std::uint32_t seed = 1; seed <= 200; ++seed) {
    testing::Random random(seed);
    StreamOptions options;
    options.max_writes = 1 + random() % 6;
    options.refine_interval = random() % 3;
    StreamState stream(small(), options);
    Client client;
    Images images;
    Microseconds now = 0;
    const auto update = [&](const std::vector<TileId>& wanted) {
      auto step = stream.step(wanted, images.lookup(), 0, ++now);
      if (!step.frame) return;
      client.apply(*step.frame);
      stream.frame_done(step.frame->frame, true);
    };
    const auto choose = [&](std::size_t count) {
      std::vector<TileId> wanted;
      while (wanted.size() < count) {
        const TileId tile(static_cast<int>(random() % 3), random() % 40);
        if (std::ranges::find(wanted, tile) == wanted.end()) wanted.push_back(tile);
        images.put(tile, 1 + random() % 5);
      }
      return wanted;
    };
    for (int moves = 0; moves < 10; ++moves) update(choose(random() % 17));
    const std::size_t slots = stream.table().capacity();
    const auto wanted = choose(1 + random() % slots);
    const auto longest = (slots + options.max_writes - 1) / options.max_writes;
    for (std::size_t i = 0; i < longest; ++i) {
      images.put(wanted[random() % wanted.size()], 10 + static_cast<std::uint32_t>(i));  // light goes on meanwhile
      update(wanted);
    }
    for (const auto tile : wanted)
      ASSERT_TRUE(client.table.contains(tile)) << "seed " << seed << ", " << options.max_writes << " writes an update";
  }
}

TEST(StreamState, RefinementsWaitForTheIntervalButNewTilesDoNot) {
  Images images;
  const TileId first(0, 1), second(0, 2);
  images.put(first, 1);
  StreamOptions options;
  options.refine_interval = 300'000;
  StreamState stream(small(), options);
  const std::vector<TileId> wanted{first, second};
  const auto start = stream.step(wanted, images.lookup(), 0, 1'000'000);
  ASSERT_TRUE(start.frame.has_value());
  stream.frame_done(start.frame->frame, true);

  images.put(first, 2);
  EXPECT_FALSE(stream.step(wanted, images.lookup(), 0, 1'100'000).frame.has_value());
  images.put(second, 1);
  const auto entered = stream.step(wanted, images.lookup(), 0, 1'200'000);
  ASSERT_TRUE(entered.frame.has_value());
  EXPECT_EQ(entered.frame->writes.size(), 2u);  // the refinement rides along
  stream.frame_done(entered.frame->frame, true);

  images.put(first, 3);
  EXPECT_FALSE(stream.step(wanted, images.lookup(), 0, 1'400'000).frame.has_value());
  EXPECT_TRUE(stream.step(wanted, images.lookup(), 0, 1'500'000).frame.has_value());
}

TEST(StreamState, APacedStreamHoldsItsNewsButNeitherAnswersNorAKeyFrame) {
  Images images;
  std::vector<TileId> wanted;
  for (std::uint32_t i = 0; i < 2; ++i) {
    wanted.push_back(TileId{0, i});
    images.put(wanted.back(), 1);
  }
  StreamState stream(small(), {});
  const auto first = stream.step({wanted.data(), 1}, images.lookup(), 0, 1'000'000, 500'000);
  ASSERT_TRUE(first.frame && first.frame->key);
  stream.frame_done(first.frame->frame, true);

  stream.view_ready(answer(1));
  const auto held = stream.step(wanted, images.lookup(), 0, 1'200'000, 500'000);
  EXPECT_FALSE(held.frame);
  ASSERT_EQ(held.no_change.size(), 1u);
  const auto due = stream.step(wanted, images.lookup(), 0, 1'500'000, 500'000);
  ASSERT_TRUE(due.frame);
  EXPECT_TRUE(due.frame->answers.empty());
  EXPECT_EQ(due.frame->writes.size(), 1u);
  stream.frame_done(due.frame->frame, true);

  images.put(wanted[0], 2);
  EXPECT_FALSE(stream.step(wanted, images.lookup(), 0, 1'600'000, 500'000).frame) << "nor is a refined tile sent";
  stream.want_key();
  EXPECT_TRUE(stream.step(wanted, images.lookup(), 0, 1'600'001, 500'000).frame);
}

TEST(StreamState, APacedStreamWithNothingToSendAnswersAtOnce) {
  Images images;
  const std::vector<TileId> wanted{TileId{0, 0}, TileId{0, 1}};  // the second has no picture yet
  images.put(wanted[0], 1);
  StreamState stream(small(), {});
  const auto first = stream.step(wanted, images.lookup(), 0, 1'000'000, 500'000);
  ASSERT_TRUE(first.frame);
  stream.frame_done(first.frame->frame, true);
  stream.view_ready(answer(1));
  const auto next = stream.step(wanted, images.lookup(), 0, 1'000'001, 500'000);
  EXPECT_FALSE(next.frame);
  EXPECT_EQ(next.no_change.size(), 1u);
}

TEST(SlotCount, IsBoundedByTheNamesOfSlots) {
  StreamFormat f;
  EXPECT_EQ(slot_count(f), 4096u);
  f.phystex_size = 16384;
  EXPECT_EQ(slot_count(f), 65535u);
}

}  // namespace
}  // namespace darm::tile_scheduler
