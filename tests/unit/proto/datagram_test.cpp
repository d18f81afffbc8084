#include "proto/datagram.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "proto/darm.pb.h"
#include "proto/limits.hpp"

namespace darm::proto {
namespace {

std::string hex(const SipTag& tag) {
  std::string out;
  for (const auto byte : tag) {
    out += "0123456789abcdef"[byte >> 4];
    out += "0123456789abcdef"[byte & 15];
  }
  return out;
}

SipKey counting_key() {
  SipKey key;
  std::iota(key.begin(), key.end(), std::uint8_t{0});
  return key;
}

wire::DatagramBody ping_body() {
  wire::DatagramBody body;
  body.mutable_ping()->set_time_us(42);
  return body;
}

TEST(SipHash, gives_the_authors_vectors) {
  std::vector<std::uint8_t> message(64);
  std::iota(message.begin(), message.end(), std::uint8_t{0});
  const auto tag = [&](std::size_t n) { return hex(siphash_2_4_128(counting_key(), std::span(message).first(n))); };
  EXPECT_EQ(tag(0), "a3817f04ba25a8e66df67214c7550293");
  EXPECT_EQ(tag(1), "da87c1d86b99af44347659119b22fc45");
  EXPECT_EQ(tag(15), "5493e99933b0a8117e08ec0f97cfc3d9");
}

TEST(DatagramGate, opens_what_was_sealed_with_its_key) {
  DatagramGate gate(counting_key(), 7);
  wire::DatagramBody body;
  ASSERT_TRUE(gate.open(seal_datagram(counting_key(), 7, 1, ping_body()), body).has_value());
  EXPECT_EQ(body.ping().time_us(), 42);
}

TEST(DatagramGate, drops_any_flipped_bit) {
  const auto good = seal_datagram(counting_key(), 7, 1, ping_body());
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    auto bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1u << (bit % 8)));
    DatagramGate gate(counting_key(), 7);
    wire::DatagramBody body;
    EXPECT_FALSE(gate.open(bad, body).has_value()) << "bit " << bit;
  }
}

TEST(DatagramGate, drops_replays_and_old_sequences) {
  DatagramGate gate(counting_key(), 7);
  wire::DatagramBody body;
  const auto at = [&](std::uint64_t n) { return gate.open(seal_datagram(counting_key(), 7, n, ping_body()), body); };
  EXPECT_TRUE(at(5).has_value());
  EXPECT_EQ(at(5).error(), DatagramFault::kReplayed);
  EXPECT_EQ(at(4).error(), DatagramFault::kReplayed);
  EXPECT_TRUE(at(6).has_value());
}

TEST(DatagramGate, a_forged_high_sequence_does_not_shut_out_the_client) {
  DatagramGate gate(counting_key(), 7);
  wire::DatagramBody body;
  SipKey other{};
  EXPECT_EQ(gate.open(seal_datagram(other, 7, ~0ull, ping_body()), body).error(), DatagramFault::kForged);
  EXPECT_TRUE(gate.open(seal_datagram(counting_key(), 7, 1, ping_body()), body).has_value());
}

TEST(DatagramGate, drops_another_sessions_datagram) {
  DatagramGate gate(counting_key(), 7);
  wire::DatagramBody body;
  EXPECT_EQ(gate.open(seal_datagram(counting_key(), 8, 1, ping_body()), body).error(), DatagramFault::kForged);
}

TEST(DatagramGate, drops_garbage_and_long_datagrams) {
  DatagramGate gate(counting_key(), 7);
  wire::DatagramBody body;
  EXPECT_EQ(gate.open(std::vector<std::uint8_t>(kMaxDatagram + 1), body).error(), DatagramFault::kTooLong);
  EXPECT_EQ(gate.open(std::vector<std::uint8_t>(100, 0xff), body).error(), DatagramFault::kGarbage);
  EXPECT_FALSE(gate.open({}, body).has_value());
  EXPECT_FALSE(claimed_session(std::vector<std::uint8_t>(100, 0xff)).has_value());
  EXPECT_EQ(claimed_session(seal_datagram(counting_key(), 8, 1, ping_body())), 8u);
}

TEST(DatagramKey, wants_sixteen_bytes) {
  EXPECT_FALSE(datagram_key(std::string(15, 'x')).has_value());
  EXPECT_TRUE(datagram_key(std::string(32, 'x')).has_value());
}

}  // namespace
}  // namespace darm::proto
