// The packer's strip: what is placed never lies on what was placed before.
#include "actors/atlas/strip.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <utility>

namespace darm::atlas {
namespace {

Footprint box_of(std::int32_t width, std::int32_t height) {
  Footprint f;
  f.width = width, f.height = height;
  f.texels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
  f.bands = {{0, height, 0, 1}};
  f.spans = {{0, width}};
  return f;
}

/// A box with a hole through its middle rows.
Footprint ring_of(std::int32_t width, std::int32_t height) {
  Footprint f = box_of(width, height);
  const auto third = height / 3;
  f.bands = {{0, third, 0, 1}, {third, height - 2 * third, 1, 2}, {height - third, third, 0, 1}};
  f.spans = {{0, width}, {0, width / 3}, {width - width / 3, width}};
  return f;
}

TEST(Strip, CoarseAndFineSearchNeverShareATexel) {
  std::mt19937 random(3);
  const auto side = [&](std::uint32_t low, std::uint32_t high) {
    return static_cast<std::int32_t>(low + random() % (high - low));
  };
  Strip strip(203, true);  // neither a whole number of words nor of cells
  std::set<std::pair<std::int32_t, std::int32_t>> taken;
  std::int32_t from = 0;
  for (int i = 0; i < 120; ++i) {
    const bool large = i % 3 == 0;
    const auto f = i % 2 ? ring_of(side(3, 60), side(3, 60)) : box_of(side(1, large ? 203 : 30), side(1, 40));
    from = 0;
    const Place place = large ? strip.coarse_fit(f, from) : strip.first_fit(f, 0);
    ASSERT_GE(place.x, 0);
    ASSERT_GE(place.y, 0);
    ASSERT_LE(place.x + f.width, strip.width());
    for (const auto& band : f.bands)
      for (const auto& s : f.spans_of(band))
        for (auto y = band.row; y < band.row + band.rows; ++y)
          for (auto x = s.begin; x < s.end; ++x)
            ASSERT_TRUE(taken.emplace(place.x + x, place.y + y).second) << "shape " << i;
    strip.take(f, place);
    ASSERT_FALSE(strip.is_free(place, f.width, f.height));
  }
}

TEST(Strip, CoarseSearchLeavesNoGapBetweenBoxes) {
  Strip strip(300, true);
  for (int i = 0; i < 4; ++i) {
    std::int32_t from = 0;
    const auto f = box_of(75, 33);
    const Place place = strip.coarse_fit(f, from);
    EXPECT_EQ(place.x % 75, 0);
    strip.take(f, place);
  }
  std::int32_t from = 0;
  EXPECT_EQ(strip.coarse_fit(box_of(300, 10), from).y, strip.height());
}

}  // namespace
}  // namespace darm::atlas
