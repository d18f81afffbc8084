#include "actors/tile_scheduler/slot_waits.hpp"

#include <gtest/gtest.h>

namespace darm::tile_scheduler {
namespace {

TEST(SlotWaits, count_from_when_a_tile_was_first_wanted_until_it_is_there) {
  PageTable table(4);
  SlotWaits waits;
  const std::vector<TileId> wanted{TileId(0, 1), TileId(0, 2), TileId(0, 3)};
  table.begin_frame(1, wanted);
  static_cast<void>(table.insert(TileId(0, 1)));
  EXPECT_TRUE(waits.update(wanted, table, 10).empty()) << "one was there at once, two wait";
  EXPECT_EQ(waits.waiting(), 2u);
  EXPECT_TRUE(waits.update(wanted, table, 20).empty());
  static_cast<void>(table.insert(TileId(0, 2)));
  EXPECT_EQ(waits.update(wanted, table, 30), std::vector<Microseconds>{20});
  EXPECT_EQ(waits.waiting(), 1u);
}

TEST(SlotWaits, forget_who_is_no_longer_wanted) {
  PageTable table(4);
  SlotWaits waits;
  const std::vector<TileId> wanted{TileId(0, 1)};
  EXPECT_TRUE(waits.update(wanted, table, 40).empty());
  EXPECT_TRUE(waits.update({}, table, 50).empty());
  EXPECT_EQ(waits.waiting(), 0u);
  EXPECT_TRUE(waits.update(wanted, table, 60).empty()) << "wanted again: it begins anew";
  table.begin_frame(1, wanted);
  static_cast<void>(table.insert(TileId(0, 1)));
  EXPECT_EQ(waits.update(wanted, table, 70), std::vector<Microseconds>{10});
}

}  // namespace
}  // namespace darm::tile_scheduler
