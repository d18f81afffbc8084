#include "client/core/stream_player.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include "client/core/egl_context.hpp"
#include "client/core/renderer_gles.hpp"
#include "tests/unit/client/h264_stream.hpp"
#include "tests/unit/client/synthetic.hpp"

namespace darm::client {
namespace {

using synthetic::H264Stream;

H264Stream::Plane flat(std::uint8_t y, std::uint8_t cb, std::uint8_t cr) {
  return [=](int plane, int, int) { return plane == 0 ? y : plane == 1 ? cb : cr; };
}

std::span<const std::uint8_t> bytes_of(const std::string& s) {
  return {reinterpret_cast<const std::uint8_t*>(s.data()), s.size()};
}

TEST(VideoDecoder, GivesEveryPictureAtOnceInBothChromas) {
  for (const bool chroma_444 : {false, true}) {
    H264Stream stream(130, 94, chroma_444);
    auto decoder = VideoDecoder::create(256, 256);
    ASSERT_TRUE(decoder);
    Picture picture;
    for (int i = 0; i < 8; ++i) {
      const auto packet = stream.encode(flat(static_cast<std::uint8_t>(40 + 20 * i), 90, 180), i == 0);
      const auto ok = decoder->decode(bytes_of(packet), picture);
      ASSERT_TRUE(ok) << ok.error().message;
      EXPECT_EQ(picture.width, 130u);
      EXPECT_EQ(picture.height, 94u);
      EXPECT_EQ(picture.chroma_444, chroma_444);
      EXPECT_EQ(picture.cb.size(), chroma_444 ? 130u * 94 : 65u * 47);
      EXPECT_NEAR(picture.y[130 * 50 + 60], 40 + 20 * i, 3);
      EXPECT_NEAR(picture.cr[100], 180, 3);
    }
  }
}

TEST(VideoDecoder, RefusesGarbageAndLargePictures) {
  auto decoder = VideoDecoder::create(64, 64);
  ASSERT_TRUE(decoder);
  Picture picture;
  EXPECT_FALSE(decoder->decode(bytes_of("no video at all, surely"), picture));
  EXPECT_FALSE(decoder->decode({}, picture));
  H264Stream stream(512, 512, false);
  EXPECT_FALSE(decoder->decode(bytes_of(stream.encode(flat(1, 2, 3), true)), picture));
}

class Player : public ::testing::Test {
 protected:
  void SetUp() override {
    scene_.emplace(*SceneModel::from_manifest(synthetic::manifest()));
    ASSERT_TRUE(scene_->add_chunk(synthetic::square_chunk()));
  }
  void open(bool lossless) { player_.emplace(*StreamPlayer::create(*scene_, {256, false, lossless})); }

  wire::StreamFrame frame(std::uint64_t number, bool key, std::uint32_t slot) {
    wire::StreamFrame f;
    f.set_frame(number);
    f.set_key(key);
    f.set_h264(stream_.encode(flat(static_cast<std::uint8_t>(50 + 10 * number), 128, 128), key));
    f.add_page_edits()->set_slot(slot);
    return f;
  }
  FrameFate apply(const wire::StreamFrame& f) {
    const auto fate = player_->apply(f, *scene_);
    EXPECT_TRUE(fate) << fate.error().message;
    return fate.value_or(FrameFate::kSkipped);
  }

  H264Stream stream_{256, 256, false};
  std::optional<SceneModel> scene_;
  std::optional<StreamPlayer> player_;
};

TEST_F(Player, AppliesPictureAndPagesTogetherOrNeither) {
  open(false);
  EXPECT_TRUE(player_->key_frame_wanted());
  const auto first = frame(5, true, 1), second = frame(6, false, 2), third = frame(7, false, 3),
             fourth = frame(8, false, 4);
  EXPECT_EQ(apply(first), FrameFate::kApplied);
  EXPECT_FALSE(player_->key_frame_wanted());
  EXPECT_EQ(apply(second), FrameFate::kApplied);
  ASSERT_NE(player_->take_news().picture, nullptr);
  // 7 is lost: 8 brings neither picture nor pages.
  EXPECT_EQ(apply(fourth), FrameFate::kSkipped);
  EXPECT_TRUE(player_->key_frame_wanted());
  EXPECT_EQ(player_->pages().slot(0), 2);
  EXPECT_TRUE(player_->take_news().empty());
  EXPECT_EQ(apply(third), FrameFate::kSkipped) << "too late";
  EXPECT_EQ(apply(frame(9, true, 9)), FrameFate::kApplied);
  EXPECT_EQ(player_->pages().slot(0), 9);
  const auto picture = player_->take_news().picture;
  ASSERT_NE(picture, nullptr);
  EXPECT_NEAR(picture->y[1000], 140, 3);
  EXPECT_EQ(player_->frame_shown(), 9u);
}

TEST_F(Player, GoesOverToAnotherStreamWithAKeyFrameOnlyAndKeepsThePictureUntilThen) {
  open(false);
  const auto of = [](std::uint64_t stream, wire::StreamFrame f) {
    f.set_stream(stream);
    return f;
  };
  EXPECT_EQ(apply(of(4, frame(7, true, 1))), FrameFate::kApplied);
  EXPECT_EQ(apply(of(4, frame(8, false, 2))), FrameFate::kApplied);
  const auto before = player_->take_news().picture;
  EXPECT_EQ(apply(of(5, frame(9, false, 3))), FrameFate::kSkipped) << "though its number would follow";
  EXPECT_TRUE(player_->key_frame_wanted());
  EXPECT_EQ(player_->pages().slot(0), 2);
  EXPECT_TRUE(player_->take_news().empty());
  EXPECT_EQ(player_->picture().y, before->y) << "what is shown stays";
  wire::StreamFrame key = of(5, frame(3, true, 9));
  key.mutable_page_edits(0)->set_tile(1);
  EXPECT_EQ(apply(key), FrameFate::kApplied) << "numbers are each stream's own";
  EXPECT_EQ(player_->pages().slot(0), kAbsent) << "the whole table is that of the new stream";
  EXPECT_EQ(player_->pages().slot(1), 9);
  EXPECT_FALSE(player_->take_news().fresh) << "of the same session";
  EXPECT_EQ(apply(of(5, frame(4, false, 6))), FrameFate::kApplied);
}

TEST_F(Player, NewsAreNoneBeforeTheFirstFrameAndTheFirstSaySo) {
  open(false);
  EXPECT_TRUE(player_->take_news().empty()) << "whoever shows the stream keeps what an earlier session left";
  EXPECT_EQ(apply(frame(3, false, 3)), FrameFate::kSkipped);
  EXPECT_TRUE(player_->take_news().empty());
  apply(frame(4, true, 1));
  const auto first = player_->take_news();
  EXPECT_TRUE(first.fresh);
  ASSERT_EQ(first.pages.size(), player_->pages().rows()) << "the whole table";
  EXPECT_EQ(first.pages.at(0)[0], 1);
  apply(frame(5, false, 2));
  const auto second = player_->take_news();
  EXPECT_FALSE(second.fresh);
  EXPECT_EQ(second.pages.at(0)[0], 2);
}

TEST_F(Player, DamagedPictureAsksForAKeyFrame) {
  open(false);
  apply(frame(1, true, 1));
  auto damaged = frame(2, false, 2);
  damaged.set_h264(std::string("\0\0\0\1\x41 broken beyond repair", 27));
  EXPECT_EQ(apply(damaged), FrameFate::kSkipped);
  EXPECT_TRUE(player_->key_frame_wanted());
  EXPECT_EQ(player_->pages().slot(0), 1);
  EXPECT_EQ(apply(frame(3, false, 3)), FrameFate::kSkipped);
  EXPECT_EQ(apply(frame(4, true, 4)), FrameFate::kApplied);
}

TEST_F(Player, KeyFrameReplacesTheWholeTable) {
  open(true);
  apply(synthetic::key_frame([](auto, int, int) { return synthetic::Colour{1, 2, 3}; }, 0, 2));
  EXPECT_EQ(player_->pages().resident(), 14u);
  EXPECT_EQ(player_->take_news().pixels.size(), 14u);
  wire::StreamFrame key;
  key.set_frame(9);
  key.set_key(true);
  key.add_page_edits()->set_slot(40);
  apply(key);
  EXPECT_EQ(player_->pages().resident(), 1u);
}

TEST_F(Player, RefusesWhatContradictsTheManifest) {
  using Change = void (*)(wire::StreamFrame&);
  const Change changes[] = {
      [](auto& f) { f.mutable_page_edits(0)->set_tile(7u << 28); },
      [](auto& f) { f.mutable_page_edits(0)->set_tile(9); },
      [](auto& f) { f.mutable_page_edits(0)->set_slot(64); },
      [](auto& f) { f.mutable_page_edits(0)->set_slot(70000); },
      [](auto& f) { f.mutable_page_edits(0)->set_coverage("not zlib"); },
      [](auto& f) {
        const auto edit = f.page_edits(0);
        for (int i = 0; i < 4 * 64; ++i) *f.add_page_edits() = edit;  // of 64 slots
      },
      [](auto& f) { f.add_pixels()->set_rgb("short"); },
      [](auto& f) {
        auto& p = *f.add_pixels();
        p.set_slot(64);
        p.set_rgb(std::string(3072, 'x'));
      },
  };
  for (const auto change : changes) {
    open(true);
    auto f = synthetic::key_frame([](auto, int, int) { return synthetic::Colour{1, 2, 3}; }, 0, 0);
    change(f);
    EXPECT_FALSE(player_->apply(f, *scene_));
    EXPECT_EQ(player_->pages().resident(), 0u) << "nothing of a refused frame stays";
  }
  open(false);
  auto bare = frame(1, true, 1);
  *bare.add_pixels() = synthetic::key_frame([](auto, int, int) { return synthetic::Colour{1, 2, 3}; }, 2, 2).pixels(0);
  EXPECT_FALSE(player_->apply(bare, *scene_));
  EXPECT_FALSE(StreamPlayer::create(*scene_, {100, false, false}));
  EXPECT_FALSE(StreamPlayer::create(*scene_, {8192, false, false}));
}

TEST_F(Player, CoverageStaysWithATileAndLeavesWithIt) {
  open(true);
  const auto grey = [](auto, int, int) { return synthetic::Colour{9, 9, 9}; };
  auto f = synthetic::key_frame(grey, 2, 2);
  const std::string plain(1024, '\x33');
  std::string packed(compressBound(1024), '\0');
  uLongf size = packed.size();
  ASSERT_EQ(
      compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(plain.data()), 1024),
      Z_OK);
  packed.resize(size);
  f.mutable_page_edits(0)->set_coverage(packed);
  apply(f);
  EXPECT_EQ(player_->take_news().coverage[3], plain);
  f.mutable_page_edits(0)->clear_coverage();  // sent once: the next key frame names the same tile without it
  apply(f);
  EXPECT_TRUE(player_->take_news().coverage.empty());
  f.mutable_page_edits(0)->set_tile(0);  // another tile, opaque, in the same slot
  apply(f);
  EXPECT_EQ(player_->take_news().coverage[3], std::string(1024, '\xff'));
  f.mutable_page_edits(0)->set_coverage(packed.substr(0, size / 2));
  EXPECT_FALSE(player_->apply(f, *scene_)) << "a cut stream is no coverage";
}

TEST_F(Player, CoarseTexMustHaveTheSizeOfItsLevel) {
  open(false);
  H264Stream still(30, 30, false);
  wire::CoarseTexture coarse;
  coarse.set_width(30);
  coarse.set_height(30);
  coarse.set_h264(still.encode(flat(99, 128, 128), true));
  const auto ok = player_->apply(coarse, *scene_);
  ASSERT_TRUE(ok) << ok.error().message;
  EXPECT_TRUE(player_->has_coarse());
  const auto picture = player_->take_news().coarse;
  ASSERT_NE(picture, nullptr);
  EXPECT_NEAR(picture->y[450], 99, 3);
  coarse.set_width(60);
  EXPECT_FALSE(player_->apply(coarse, *scene_));
}

TEST_F(Player, CodedStreamIsDrawnInItsColours) {
  auto context = EglContext::create();
  if (!context) GTEST_SKIP() << context.error().message;
  open(false);
  wire::StreamFrame f;
  f.set_frame(1);
  f.set_key(true);
  // Slots of two colours side by side: level 0 is the first, all else the second. Chroma must not bleed.
  f.set_h264(stream_.encode(
      [](int plane, int x, int y) -> std::uint8_t {
        const int slot = y / (plane ? 16 : 32) * 8 + x / (plane ? 16 : 32);
        const bool used = slot < 18 && slot % 2 == 0;
        return plane == 0 ? (used ? 90 : 200) : plane == 1 ? (used ? 100 : 250) : (used ? 170 : 10);
      },
      true));
  for (std::uint32_t i = 0; i < 9; ++i) {
    auto& edit = *f.add_page_edits();
    edit.set_tile(i);
    edit.set_slot(i * 2);
  }
  EXPECT_EQ(apply(f), FrameFate::kApplied);
  auto renderer = GlesRenderer::create(*scene_, player_->shape());
  ASSERT_TRUE(renderer) << renderer.error().message;
  ASSERT_TRUE((*renderer)->synchronise(*scene_, *player_));
  ASSERT_TRUE((*renderer)->draw(*scene_, look_at({1, 1, 1}, {1, 1, 0}, 90, 96, 96)));
  const auto image = (*renderer)->read_picture();
  ASSERT_TRUE(image);
  const int expected[] = {90 + static_cast<int>(1.5748 * 42), 90 - static_cast<int>(0.187324 * -28 + 0.468124 * 42),
                          90 + static_cast<int>(1.8556 * -28)};
  for (std::size_t i = 0; i < image->rgb.size(); ++i) ASSERT_NEAR(image->rgb[i], expected[i % 3], 5) << "byte " << i;
}

TEST_F(Player, RefusesAShareOfWhatIsBehindThatIsNoTileAndKeepsItWithTheTile) {
  open(true);
  const auto packed = [](std::size_t n) {
    const std::string tile(n, '\x55');
    std::string out(compressBound(n), '\0');
    uLongf size = out.size();
    compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(tile.data()), n);
    out.resize(size);
    return out;
  };
  auto f = synthetic::key_frame([](std::uint32_t, int, int) { return synthetic::Colour{1, 2, 3}; }, 2, 2);
  for (const auto& bad : {std::string("junk"), packed(3071), packed(1024), packed(5000)}) {
    f.mutable_page_edits(0)->set_through(bad);
    EXPECT_FALSE(player_->apply(f, *scene_));
    EXPECT_TRUE(player_->take_news().through.empty());
  }
  f.mutable_page_edits(0)->set_through(packed(3072));
  EXPECT_EQ(apply(f), FrameFate::kApplied);
  EXPECT_EQ(player_->take_news().through.at(3).size(), 3072u);
  f.mutable_page_edits(0)->clear_through();  // the tile stays: so does what came with it
  EXPECT_EQ(apply(f), FrameFate::kApplied);
  EXPECT_TRUE(player_->take_news().through.empty());
  f.mutable_page_edits(0)->set_tile(1u << 28);  // another tile, opaque
  EXPECT_EQ(apply(f), FrameFate::kApplied);
  EXPECT_EQ(player_->take_news().through.at(3), std::string(3072, '\0'));
}

}  // namespace
}  // namespace darm::client
