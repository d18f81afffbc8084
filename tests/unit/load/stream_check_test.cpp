#include "client/load/stream_check.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "client/load/table_witness.hpp"
#include "tests/unit/load/made_up_server.hpp"

namespace darm::client::load {
namespace {

using made_up::frame;

constexpr std::uint32_t kAbsentSlot = 65535;

class StreamCheckTest : public ::testing::Test {
 protected:
  void SetUp() override {
    scene_ = std::make_shared<const SceneModel>(SceneModel::from_manifest(synthetic::manifest()).value());
    check_.emplace(scene_, StreamShape{made_up::kPhysTex, false, false});
  }
  FrameNews take(const wire::StreamFrame& f) { return check_->take(f, faults_); }
  /// Exactly this fault, so often, and no other.
  void expect_only(Fault fault, std::uint64_t times = 1) {
    EXPECT_EQ(faults_.of(fault), times) << to_string(fault);
    EXPECT_EQ(faults_.total(), times);
  }

  std::shared_ptr<const SceneModel> scene_;
  std::optional<StreamCheck> check_;
  FaultCounts faults_;
};

TEST_F(StreamCheckTest, AStreamInOrderHasNoFault) {
  EXPECT_TRUE(take(frame(1, true, {{0, 3}, {1, 4}, {1u << 28, 5}})).applied);
  EXPECT_TRUE(take(frame(2, false, {{1, kAbsentSlot}, {2, 4}})).applied);
  EXPECT_TRUE(take(frame(3, false)).applied);
  EXPECT_TRUE(take(frame(4, true, {{0, 3}, {2, 4}})).applied);
  EXPECT_EQ(faults_.total(), 0u);
  EXPECT_EQ(check_->residents(), 2u);
  EXPECT_EQ(check_->frame_shown(), 4u);
}

TEST_F(StreamCheckTest, AnAbsentEditWithinAKeyFrameIsNoFault) {
  take(frame(1, true, {{0, 3}}));
  take(frame(2, true, {{0, 3}, {1, 4}, {1, kAbsentSlot}, {2, kAbsentSlot}, {3, 4}}));
  EXPECT_EQ(faults_.total(), 0u);
  EXPECT_EQ(check_->residents(), 2u);
}

TEST_F(StreamCheckTest, AMissingFrameIsCountedOnceUntilTheNextKeyFrame) {
  take(frame(1, true));
  EXPECT_FALSE(take(frame(3, false)).applied);
  EXPECT_TRUE(check_->key_frame_wanted());
  EXPECT_FALSE(take(frame(4, false)).applied);
  expect_only(Fault::kFrameOrder);
  EXPECT_TRUE(take(frame(5, true)).applied);
  EXPECT_FALSE(check_->key_frame_wanted());
  EXPECT_TRUE(take(frame(6, false)).applied);
  expect_only(Fault::kFrameOrder);
}

TEST_F(StreamCheckTest, AFrameThatComesTwiceIsOutOfOrder) {
  take(frame(1, true));
  take(frame(2, false));
  EXPECT_FALSE(take(frame(2, false)).applied);
  expect_only(Fault::kFrameOrder);
}

TEST_F(StreamCheckTest, AStreamThatDoesNotBeginWithAKeyFrameIsOutOfOrder) {
  EXPECT_FALSE(take(frame(1, false)).applied);
  expect_only(Fault::kFrameOrder);
}

TEST_F(StreamCheckTest, FramesDroppedBeforeAKeyFrameAreNoFault) {
  take(frame(1, true));
  EXPECT_EQ(take(frame(9, true)).dropped, 7u);
  EXPECT_EQ(take(frame(10, true)).dropped, 0u);
  EXPECT_EQ(faults_.total(), 0u);
}

TEST_F(StreamCheckTest, ATileThatTheManifestDoesNotHaveIsFound) {
  take(frame(1, true, {{0, 3}, {9, 4}}));  // level 0 has 3 x 3 tiles
  expect_only(Fault::kTile);
  take(frame(2, false, {{5u << 28, 5}}));
  expect_only(Fault::kTile, 2);
  EXPECT_EQ(check_->residents(), 1u);
}

TEST_F(StreamCheckTest, ASlotOutsideOfPhysTexIsFound) {
  take(frame(1, true, {{0, 1023}, {1, 1024}}));
  expect_only(Fault::kSlot);
}

TEST_F(StreamCheckTest, ATileInTwoSlotsIsFound) {
  take(frame(1, true, {{0, 3}, {1, 4}}));
  take(frame(2, false, {{0, 7}}));
  expect_only(Fault::kTileTwice);
  take(frame(3, true, {{0, 3}, {0, 4}}));
  expect_only(Fault::kTileTwice, 2);
}

TEST_F(StreamCheckTest, ATileThatLeavesItsSlotFirstMayHaveAnother) {
  take(frame(1, true, {{0, 3}}));
  take(frame(2, false, {{0, kAbsentSlot}, {0, 7}}));
  EXPECT_EQ(faults_.total(), 0u);
}

TEST_F(StreamCheckTest, ASlotWithTwoTilesIsFound) {
  take(frame(1, true, {{0, 3}, {1, 3}}));
  expect_only(Fault::kSlotTwice);
  take(frame(2, false, {{2, 3}}));
  expect_only(Fault::kSlotTwice, 2);
}

TEST_F(StreamCheckTest, WithinAFrameASlotMayPassFromHandToHand) {
  take(frame(1, true, {{0, 3}, {1, 4}}));
  take(frame(2, false, {{2, 3}, {0, kAbsentSlot}}));  // the newcomer is named before the one that leaves
  EXPECT_EQ(faults_.total(), 0u);
  EXPECT_EQ(check_->residents(), 2u);
}

TEST_F(StreamCheckTest, AFrameWithoutAPictureIsFound) {
  auto f = frame(1, true);
  f.clear_h264();
  take(f);
  expect_only(Fault::kNoPicture);
}

TEST_F(StreamCheckTest, APictureThatIsNotWhatItsFrameSaysIsFound) {
  auto key = frame(1, true);
  key.set_h264(made_up::delta_picture());
  take(key);
  expect_only(Fault::kWrongPicture);
  auto delta = frame(2, false);
  delta.set_h264(made_up::key_picture());
  take(delta);
  expect_only(Fault::kWrongPicture, 2);
  auto bare = frame(3, false);
  bare.add_pixels();
  take(bare);
  expect_only(Fault::kWrongPicture, 3);
}

TEST_F(StreamCheckTest, AnErrorThatIsNoNumberIsFound) {
  for (const float error : {NAN, INFINITY, -0.1f}) {
    auto f = frame(1, true);
    f.set_error(error);
    take(f);
  }
  expect_only(Fault::kError, 3);
}

TEST_F(StreamCheckTest, EqualTablesHaveEqualHashesByWhateverWay) {
  take(frame(1, true, {{0, 3}}));
  take(frame(2, false, {{1, 4}}));
  take(frame(3, false, {{2, 5}, {0, kAbsentSlot}}));
  StreamCheck late(scene_, {made_up::kPhysTex, false, false});
  late.take(frame(3, true, {{2, 5}, {1, 4}}), faults_);
  EXPECT_EQ(late.table(), check_->table());
  StreamCheck lacking(scene_, {made_up::kPhysTex, false, false});
  lacking.take(frame(3, true, {{2, 5}}), faults_);
  EXPECT_NE(lacking.table(), check_->table()) << "a key frame without the whole table";
  StreamCheck swapped(scene_, {made_up::kPhysTex, false, false});
  swapped.take(frame(3, true, {{2, 4}, {1, 5}}), faults_);
  EXPECT_NE(swapped.table(), check_->table());
}

TEST_F(StreamCheckTest, AnotherStreamBeginsWithAKeyFrameWhoseNumberIsItsOwn) {
  auto first = frame(100, true, {{0, 3}}), other = frame(7, true, {{1, 3}}), next = frame(8, false);
  first.set_stream(1);
  other.set_stream(2);
  next.set_stream(2);
  take(first);
  EXPECT_EQ(take(other).dropped, 0u);
  EXPECT_TRUE(take(next).applied);
  EXPECT_EQ(check_->stream(), 2u);
  EXPECT_EQ(faults_.total(), 0u);
  auto wrong = frame(9, false);
  wrong.set_stream(3);
  EXPECT_FALSE(take(wrong).applied);
  expect_only(Fault::kStreamWithoutKey);
}

TEST(TableWitness, ClientsOfOneStreamHaveOneTablePerFrame) {
  TableWitness witness;
  EXPECT_TRUE(witness.agrees(1, 5, 77));
  EXPECT_TRUE(witness.agrees(1, 5, 77));
  EXPECT_FALSE(witness.agrees(1, 5, 78));
  EXPECT_TRUE(witness.agrees(2, 5, 78)) << "another stream";
  EXPECT_TRUE(witness.agrees(1, 6, 78)) << "another frame";
  for (std::uint64_t i = 0; i < TableWitness::kMostFrames; ++i) EXPECT_TRUE(witness.agrees(3, i, 0));
  EXPECT_TRUE(witness.agrees(1, 5, 99)) << "forgotten: memory is bounded";
}

}  // namespace
}  // namespace darm::client::load
