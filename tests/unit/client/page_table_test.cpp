#include "client/core/page_table.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace darm::client {
namespace {

TEST(PageTable, BehavesLikeAMapUnderRandomEdits) {
  constexpr std::uint32_t tiles = 10000;
  PageTable table(tiles);
  std::map<std::uint32_t, std::uint16_t> model;
  std::mt19937 random(7);
  for (int i = 0; i < 50000; ++i) {
    const auto entry = static_cast<std::uint32_t>(random() % tiles);
    if (random() % 5000 == 0) {
      table.clear();
      model.clear();
    } else if (random() % 3 == 0) {
      table.set(entry, kAbsent);
      model.erase(entry);
    } else {
      const auto slot = static_cast<std::uint16_t>(random() % 4096);
      table.set(entry, slot);
      model[entry] = slot;
    }
  }
  EXPECT_EQ(table.resident(), model.size());
  for (std::uint32_t e = 0; e < tiles; ++e) EXPECT_EQ(table.slot(e), model.contains(e) ? model[e] : kAbsent);
}

TEST(PageTable, UploadsEveryRowOnceThenOnlyWhatChanged) {
  PageTable table(5 * kTableWidth);
  auto rows = table.take_dirty_rows();
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].count, 5u);
  EXPECT_TRUE(table.take_dirty_rows().empty());
  table.set(0, 1);
  table.set(kTableWidth, 2);
  table.set(4 * kTableWidth + 9, 3);
  rows = table.take_dirty_rows();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].first, 0u);
  EXPECT_EQ(rows[0].count, 2u);
  EXPECT_EQ(rows[1].first, 4u);
  table.clear();
  EXPECT_EQ(table.take_dirty_rows().size(), 2u);  // rows that held nothing stay
  table.set(3, kAbsent);
  EXPECT_TRUE(table.take_dirty_rows().empty());
}

}  // namespace
}  // namespace darm::client
