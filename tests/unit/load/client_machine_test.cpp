#include "client/load/client_machine.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/load/made_up_server.hpp"

namespace darm::client::load {
namespace {

using made_up::bytes;
using Envelope = wire::Envelope;
using Phase = ClientMachine::Phase;

constexpr std::int64_t kMs = 1'000;

std::vector<Envelope> envelopes(const std::vector<Outgoing>& out) {
  proto::FrameReader reader(1 << 20);
  for (const auto& o : out)
    if (!o.datagram) reader.feed(o.bytes);
  std::vector<Envelope> all;
  Envelope envelope;
  while (reader.next(envelope).value_or(false)) all.push_back(envelope);
  return all;
}

// One client, and what a good server has sent it so far.
class ClientMachineTest : public ::testing::Test {
 protected:
  ClientMachineTest() { settings_.epoch_us = 1; }
  ClientMachine make() { return {ClientPlan{}, settings_, route_, commons_, nullptr, 1}; }
  void welcome(std::uint32_t udp_port = 0) {
    send(bytes(made_up::welcome(udp_port), &Envelope::mutable_welcome));
    send(bytes(synthetic::manifest(), &Envelope::mutable_manifest));
    send(bytes(synthetic::square_chunk(), &Envelope::mutable_geometry));
    send(bytes(made_up::coarse(), &Envelope::mutable_coarse));
  }
  void send(const std::vector<std::uint8_t>& message) { machine_.receive(message, now_); }
  void send_frame(std::uint64_t number, bool key, std::uint64_t answers) {
    auto f = made_up::frame(number, key);
    f.set_answers(answers);
    send(bytes(std::move(f), &Envelope::mutable_frame));
  }
  void send_no_change(std::uint64_t answers, float error = 0) {
    wire::NoChange n;
    n.set_answers(answers);
    n.set_error(error);
    send(bytes(std::move(n), &Envelope::mutable_no_change));
  }
  void expect_only(Fault fault, std::uint64_t times = 1) {
    EXPECT_EQ(machine_.figures().faults.of(fault), times) << to_string(fault);
    EXPECT_EQ(machine_.figures().faults.total(), times);
  }

  MachineSettings settings_;
  Route route_{{}, {{0, {1, 2, 3}, {1, 2, 0}, 60}}, 1};
  Commons commons_;
  ClientMachine machine_ = make();
  std::int64_t now_ = 1;
};

TEST_F(ClientMachineTest, CamerasGoOutAtTheServersRate) {
  EXPECT_TRUE(machine_.due(now_).empty()) << "not before the welcome";
  welcome();
  int cameras = 0;
  for (; now_ < 1'000 * kMs; now_ += 5 * kMs) {
    for (const auto& e : envelopes(machine_.due(now_))) {
      ASSERT_TRUE(e.has_camera());
      EXPECT_EQ(e.camera().sequence(), static_cast<std::uint64_t>(++cameras));
      EXPECT_DOUBLE_EQ(e.camera().pose().position().z(), 3);
    }
  }
  EXPECT_EQ(cameras, 10);
}

TEST_F(ClientMachineTest, AfterAPauseCamerasAreNotMadeUpFor) {
  welcome();
  (void)machine_.due(now_);
  now_ += 5'000 * kMs;
  int cameras = 0;
  for (int i = 0; i < 10; ++i) cameras += static_cast<int>(machine_.due(now_ + i * kMs).size());
  EXPECT_LE(cameras, 2);
}

TEST_F(ClientMachineTest, CamerasGoByUdpWhereTheServerOffersIt) {
  welcome(9011);
  const auto out = machine_.due(now_);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_TRUE(out[0].datagram);
  proto::DatagramGate gate(proto::datagram_key(made_up::welcome().key()).value(), 7);
  wire::DatagramBody body;
  ASSERT_TRUE(gate.open(out[0].bytes, body).has_value());
  EXPECT_EQ(body.camera().sequence(), 1u);
  EXPECT_EQ(machine_.udp_port(), 9011u);
}

TEST_F(ClientMachineTest, AGoodServerHasNoFaultAndIsCountedFromTheFirstFrameOn) {
  machine_.begin_counting(now_);
  welcome();
  (void)machine_.due(now_);
  now_ += 30 * kMs;
  send_frame(1, true, 1);
  EXPECT_EQ(machine_.phase(), Phase::kStreaming);
  EXPECT_EQ(machine_.figures().answers, 0u) << "the first frame ends the joining";
  now_ = 101 * kMs;
  (void)machine_.due(now_);
  now_ += 40 * kMs;
  send_frame(2, false, 2);
  now_ = 201 * kMs;
  (void)machine_.due(now_);
  now_ += 20 * kMs;
  send_no_change(3);
  machine_.end_counting(now_);
  const auto& f = machine_.figures();
  EXPECT_EQ(f.faults.total(), 0u);
  EXPECT_EQ(f.answers, 2u);
  EXPECT_EQ(f.stream_frames, 1u);
  EXPECT_EQ(f.no_changes, 1u);
  EXPECT_EQ(f.waits_ms, (std::vector<float>{40, 20}));
  EXPECT_EQ(f.first_frame_us, 1 + 30 * kMs);
}

TEST_F(ClientMachineTest, AfterAStallItHasCaughtUpWithTheAnswerToACameraSentSince) {
  welcome();
  (void)machine_.due(now_);
  send_frame(1, true, 1);
  const auto end = now_ + 500 * kMs;
  machine_.stalls(end);
  now_ += 200 * kMs;
  (void)machine_.due(now_);  // camera 2: it waits
  now_ = end + 10 * kMs;
  send_no_change(2);
  EXPECT_EQ(machine_.figures().caught_up_us, 0) << "that was old";
  (void)machine_.due(now_);
  now_ += 30 * kMs;
  send_frame(2, false, 3);
  EXPECT_EQ(machine_.figures().caught_up_us, now_);
  EXPECT_EQ(machine_.figures().fresh_picture_us, now_);
  now_ += 100 * kMs;
  (void)machine_.due(now_);
  send_frame(3, false, 4);
  EXPECT_LT(machine_.figures().caught_up_us, now_) << "the first counts";
}

TEST_F(ClientMachineTest, BytesMayComeInAnyPieces) {
  const auto message = bytes(made_up::welcome(), &Envelope::mutable_welcome);
  for (const auto byte : message) send({byte});
  EXPECT_EQ(machine_.phase(), Phase::kWelcomed);
}

TEST_F(ClientMachineTest, AMissingFrameIsCountedAndAKeyFrameAskedFor) {
  welcome();
  send_frame(1, true, 0);
  (void)machine_.due(now_);
  send_frame(3, false, 0);
  expect_only(Fault::kFrameOrder);
  now_ += 600 * kMs;
  bool asked = false;
  for (const auto& e : envelopes(machine_.due(now_))) asked = asked || e.feedback().key_frame_wanted();
  EXPECT_TRUE(asked);
}

TEST_F(ClientMachineTest, AnswersThatGoBackwardsOrAnswerNothingSentAreFaults) {
  welcome();
  send_frame(1, true, 1);
  expect_only(Fault::kAnswerUnsent);
  for (int i = 0; i < 3; ++i) (void)machine_.due(now_ += 100 * kMs);
  send_no_change(3);
  send_frame(2, false, 2);
  EXPECT_EQ(machine_.figures().faults.of(Fault::kAnswerBackwards), 1u);
  EXPECT_EQ(machine_.figures().faults.total(), 2u);
}

TEST_F(ClientMachineTest, AnErrorThatIsNoNumberIsAFault) {
  welcome();
  send_frame(1, true, 0);
  send_no_change(0, NAN);
  expect_only(Fault::kError);
}

TEST_F(ClientMachineTest, AManifestThatContradictsItselfIsAFault) {
  send(bytes(made_up::welcome(), &Envelope::mutable_welcome));
  auto manifest = synthetic::manifest();
  manifest.mutable_levels(0)->set_tiles_x(4);
  send(bytes(std::move(manifest), &Envelope::mutable_manifest));
  expect_only(Fault::kManifest);
}

TEST_F(ClientMachineTest, AChunkThatWasNotAnnouncedOrCameBeforeIsAFault) {
  welcome();
  send(bytes(synthetic::square_chunk(), &Envelope::mutable_geometry));
  expect_only(Fault::kGeometry);
  auto chunk = synthetic::square_chunk();
  chunk.set_index(1);
  send(bytes(std::move(chunk), &Envelope::mutable_geometry));
  expect_only(Fault::kGeometry, 2);
}

TEST_F(ClientMachineTest, ACoarseTextureOfAnotherSizeOrWithoutAKeyFrameIsAFault) {
  welcome();
  auto coarse = made_up::coarse();
  coarse.set_width(60);
  send(bytes(coarse, &Envelope::mutable_coarse));
  coarse = made_up::coarse();
  coarse.set_h264(made_up::delta_picture());
  send(bytes(coarse, &Envelope::mutable_coarse));
  expect_only(Fault::kCoarse, 2);
}

TEST_F(ClientMachineTest, AFrameBeforeTheManifestIsAFault) {
  send(bytes(made_up::welcome(), &Envelope::mutable_welcome));
  send_frame(1, true, 0);
  expect_only(Fault::kMessage);
}

TEST_F(ClientMachineTest, WhatIsNoEnvelopeEndsTheSession) {
  welcome();
  send({0xff, 0xff, 0xff, 0xff});  // a length over the limit, refused before memory is taken
  expect_only(Fault::kMessage);
  EXPECT_EQ(machine_.phase(), Phase::kEnded);
  EXPECT_EQ(machine_.end(), "bad_message");
  EXPECT_TRUE(machine_.due(now_ + 1'000 * kMs).empty());
}

TEST_F(ClientMachineTest, ASizeThatWasNotAskedForIsRefused) {
  auto w = made_up::welcome();
  w.set_phystex_size(1 << 20);
  send(bytes(std::move(w), &Envelope::mutable_welcome));
  expect_only(Fault::kMessage);
  EXPECT_EQ(machine_.phase(), Phase::kEnded);
}

TEST_F(ClientMachineTest, AGoodbyeEndsItWithItsReason) {
  wire::Goodbye g;
  g.set_reason(wire::Goodbye::SERVER_FULL);
  send(bytes(made_up::welcome(), &Envelope::mutable_welcome));
  send(bytes(std::move(g), &Envelope::mutable_goodbye));
  EXPECT_EQ(machine_.end(), "SERVER_FULL");
  EXPECT_EQ(machine_.figures().faults.total(), 0u);
}

TEST_F(ClientMachineTest, AServerThatFallsSilentIsGivenUp) {
  welcome();
  (void)machine_.due(now_ + 29'000 * kMs);
  EXPECT_NE(machine_.phase(), Phase::kEnded);
  (void)machine_.due(now_ + 31'000 * kMs);
  EXPECT_EQ(machine_.end(), "silence");
}

TEST_F(ClientMachineTest, CamerasThatNobodyAnswersCountWithWhatTheyHaveWaited) {
  welcome();
  send_frame(1, true, 0);
  machine_.begin_counting(now_);
  (void)machine_.due(now_);
  machine_.end_counting(now_ + 5'000 * kMs);
  EXPECT_EQ(machine_.figures().waits_ms, std::vector<float>{5'000});
}

}  // namespace
}  // namespace darm::client::load
