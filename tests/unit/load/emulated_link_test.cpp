#include "client/load/emulated_link.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace darm::client::load {
namespace {

std::vector<std::uint8_t> piece(std::size_t bytes, std::uint8_t value = 1) {
  return std::vector<std::uint8_t>(bytes, value);
}

TEST(EmulatedLink, BytesArriveAfterTheDelay) {
  EmulatedLink link({50, 0, 0}, 1);
  link.push(piece(10), 1'000);
  EXPECT_FALSE(link.pop(50'999).has_value());
  EXPECT_EQ(link.pop(51'000)->size(), 10u);
  EXPECT_FALSE(link.pop(1'000'000).has_value());
}

TEST(EmulatedLink, ARateIsKeptWhateverThePieces) {
  EmulatedLink link({0, 10'000, 0}, 1);
  for (int i = 0; i < 10; ++i) link.push(piece(1'000), 0);
  std::size_t got = 0;
  for (std::int64_t now = 0; now <= 500'000; now += 1'000)
    while (const auto p = link.pop(now)) got += p->size();
  EXPECT_EQ(got, 5'000u);
}

TEST(EmulatedLink, WhatIsOnItsWayIsBounded) {
  EmulatedLink link({0, 10'000, 0}, 1);
  const auto most = link.room();
  EXPECT_LE(most, 16u * 1024);
  link.push(piece(most), 0);
  EXPECT_EQ(link.room(), 0u);
  EXPECT_TRUE(link.pop(10'000'000).has_value());
  EXPECT_EQ(link.room(), most);
}

TEST(EmulatedLink, LossDelaysAndNeverReordersNorLosesBytes) {
  EmulatedLink link({50, 0, 0.2}, 3);
  for (std::uint8_t i = 0; i < 100; ++i) link.push(piece(1'000, i), i * 10'000);
  std::uint8_t next = 0;
  int late = 0;
  for (std::int64_t now = 0; now < 3'000'000; now += 1'000) {
    while (const auto p = link.pop(now)) {
      EXPECT_EQ(p->front(), next);
      late += now - next * 10'000 > 51'000 ? 1 : 0;
      ++next;
    }
  }
  EXPECT_EQ(next, 100);
  EXPECT_GT(late, 20) << "a fifth, and what came behind it";
}

}  // namespace
}  // namespace darm::client::load
