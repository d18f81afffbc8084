#include "proto/framing.hpp"

#include <gtest/gtest.h>

#include "proto/darm.pb.h"
#include "proto/limits.hpp"

namespace darm::proto {
namespace {

wire::Envelope ping(std::int64_t time) {
  wire::Envelope e;
  e.mutable_ping()->set_time_us(time);
  return e;
}

std::vector<std::uint8_t> three_messages() {
  std::vector<std::uint8_t> stream;
  wire::Envelope hello;
  hello.mutable_hello()->set_client("a client");
  for (const auto& e : {ping(1), hello, ping(1'000'000'000'000)}) {
    const auto bytes = frame(e);
    stream.insert(stream.end(), bytes.begin(), bytes.end());
  }
  return stream;
}

TEST(FrameReader, gives_the_same_messages_wherever_the_stream_is_cut) {
  const auto stream = three_messages();
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    FrameReader reader(1024);
    std::vector<wire::Envelope> got;
    const std::span<const std::uint8_t> all(stream);
    for (const auto piece : {all.first(cut), all.subspan(cut)}) {
      reader.feed(piece);
      wire::Envelope e;
      while (reader.next(e).value()) got.push_back(e);
    }
    ASSERT_EQ(got.size(), 3u) << "cut at " << cut;
    EXPECT_EQ(got[0].ping().time_us(), 1);
    EXPECT_EQ(got[1].hello().client(), "a client");
    EXPECT_EQ(got[2].ping().time_us(), 1'000'000'000'000);
    EXPECT_EQ(reader.buffered(), 0u);
  }
}

TEST(FrameReader, takes_single_bytes) {
  FrameReader reader(1024);
  int got = 0;
  wire::Envelope e;
  for (const auto byte : three_messages()) {
    reader.feed({&byte, 1});
    while (reader.next(e).value()) ++got;
  }
  EXPECT_EQ(got, 3);
}

TEST(FrameReader, refuses_a_long_message_before_taking_memory) {
  FrameReader reader(1024);
  const std::array<std::uint8_t, 4> huge{0xff, 0xff, 0xff, 0xff};
  reader.feed(huge);
  EXPECT_EQ(reader.buffered(), 0u);
  const std::vector<std::uint8_t> more(100'000);
  reader.feed(more);
  EXPECT_EQ(reader.buffered(), 0u);
  wire::Envelope e;
  const auto result = reader.next(e);
  ASSERT_FALSE(result.has_value());
  EXPECT_NE(result.error().find("limit"), std::string::npos);
}

TEST(FrameReader, refuses_the_second_message_too) {
  FrameReader reader(16);
  auto stream = frame(ping(1));
  stream.insert(stream.end(), {0, 0, 0, 17});
  reader.feed(stream);
  wire::Envelope e;
  EXPECT_TRUE(reader.next(e).value());
  EXPECT_FALSE(reader.next(e).has_value());
  EXPECT_FALSE(reader.next(e).has_value());
}

TEST(FrameReader, knows_a_port_for_browsers) {
  FrameReader reader(kMaxServerEnvelope);
  const std::string reply = "HTTP/1.1 400 Bad Request\r\n\r\n";
  reader.feed({reinterpret_cast<const std::uint8_t*>(reply.data()), reply.size()});
  wire::Envelope e;
  const auto result = reader.next(e);
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().find("HTTP"), std::string::npos) << result.error();
}

TEST(FrameReader, names_bytes_that_are_no_envelope) {
  FrameReader reader(1024);
  const std::array<std::uint8_t, 7> bad{0, 0, 0, 3, 0xff, 0xff, 0xff};
  reader.feed(bad);
  wire::Envelope e;
  EXPECT_FALSE(reader.next(e).has_value());
}

TEST(FrameReader, an_empty_message_is_an_envelope_without_body) {
  FrameReader reader(1024);
  const std::array<std::uint8_t, 4> empty{};
  reader.feed(empty);
  wire::Envelope e;
  EXPECT_TRUE(reader.next(e).value());
  EXPECT_EQ(e.body_case(), wire::Envelope::BODY_NOT_SET);
}

}  // namespace
}  // namespace darm::proto
