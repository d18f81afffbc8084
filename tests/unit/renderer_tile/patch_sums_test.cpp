// Sums around texels against the plain double loop that they stand for.
#include "actors/renderer/patch_sums.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace darm::renderer {
namespace {

constexpr int kSize = 52;
constexpr std::uint32_t kNobody = 0xffffffffu;

// Patches with ragged borders, holes and texels of nobody.
std::vector<std::uint32_t> ragged(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::uint32_t> key(kSize * kSize);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const auto noise = random() % 40;
      key[static_cast<std::size_t>(y * kSize + x)] = noise == 0 ? kNobody
                                                     : noise == 1
                                                         ? 9u
                                                         : static_cast<std::uint32_t>((x + y / 3) / 17 * 4 + y / 23);
    }
  return key;
}

// Texels of the same key without a gap, `step` apart, at most `radius` away.
template <class Visit>
void along(const std::vector<std::uint32_t>& key, int at, int step, int before, int after, int radius,
           const Visit& visit) {
  if (key[static_cast<std::size_t>(at)] == kNobody) return;
  for (const int sign : {-1, 1})
    for (int d = sign < 0 ? 1 : 0; d <= std::min(radius, sign < 0 ? before : after); ++d) {
      const int other = at + sign * d * step;
      if (key[static_cast<std::size_t>(other)] != key[static_cast<std::size_t>(at)]) break;
      visit(other);
    }
}

TEST(PatchSums, AreTheSumsOverSquaresThatStayInThePatch) {
  const auto key = ragged(3);
  auto in_columns = ragged(6);  // as if other walls stood across columns than across rows
  for (std::size_t i = 0; i < key.size(); ++i)
    in_columns[i] = key[i] == kNobody ? kNobody : in_columns[i] == kNobody ? 99u : in_columns[i];
  std::mt19937 random(4);
  std::vector<float> plane(key.size());
  for (auto& v : plane) v = static_cast<float>(random() % 100);  // sums are whole numbers, and exact
  PatchSums sums;
  sums.connect(key, in_columns, kSize, kNobody);
  for (const int radius : {1, 3, 7}) {
    auto fast = plane;
    sums.sum(fast, radius);
    std::vector<float> rows(plane.size(), 0.0f);
    for (int i = 0; i < kSize * kSize; ++i)
      along(key, i, 1, i % kSize, kSize - 1 - i % kSize, radius,
            [&](int other) { rows[static_cast<std::size_t>(i)] += plane[static_cast<std::size_t>(other)]; });
    for (int i = 0; i < kSize * kSize; ++i) {
      if (key[static_cast<std::size_t>(i)] == kNobody) continue;
      float slow = 0;
      along(in_columns, i, kSize, i / kSize, kSize - 1 - i / kSize, radius,
            [&](int other) { slow += rows[static_cast<std::size_t>(other)]; });
      ASSERT_EQ(fast[static_cast<std::size_t>(i)], slow) << i << " radius " << radius;
    }
  }
}

TEST(PatchSums, ABrightTexelLeavesNothingBehindWhereItDoesNotReach) {
  const std::vector<std::uint32_t> key(kSize * kSize, 1u);
  std::vector<float> plane(key.size(), 1.0f);
  plane[10 * kSize + 10] = 1e12f;
  PatchSums sums;
  sums.connect(key, key, kSize, kNobody);
  sums.sum(plane, 3);
  EXPECT_EQ(plane[10 * kSize + 14], 49.0f);
  EXPECT_EQ(plane[14 * kSize + 10], 49.0f);
}

TEST(PatchSums, ReachCountsTexelsOfTheKeyToEachSide) {
  const auto key = ragged(5);
  PatchSums sums;
  sums.connect(key, key, kSize, kNobody);
  std::array<std::vector<float>, 4> reach;
  sums.reach(reach);
  for (int i = 0; i < kSize * kSize; ++i) {
    const int x = i % kSize, y = i / kSize;
    int sides[4] = {};
    along(key, i, 1, x, kSize - 1 - x, kMaxSumRadius, [&](int o) { o != i ? ++sides[o < i ? 0 : 1] : 0; });
    along(key, i, kSize, y, kSize - 1 - y, kMaxSumRadius, [&](int o) { o != i ? ++sides[o < i ? 2 : 3] : 0; });
    for (std::size_t d = 0; d < 4; ++d)
      ASSERT_EQ(reach[d][static_cast<std::size_t>(i)], sides[d]) << i << " side " << d;
  }
}

}  // namespace
}  // namespace darm::renderer
