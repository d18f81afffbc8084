#include "actors/tile_scheduler/page_table.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/unit/tile_scheduler/random.hpp"

namespace darm::tile_scheduler {
namespace {

TEST(PageTable, RandomOperationsKeepItAOneToOneMapThatItsEditsRebuild) {
  testing::Random rng(1);
  for (int round = 0; round < 20; ++round) {
    const std::size_t slots = 1 + rng() % 40;
    PageTable table(slots);
    std::map<TileId, SlotIndex> mirror;  // what a client makes of the edits
    std::map<TileId, std::uint64_t> needed_at;
    for (std::uint64_t frame = 1; frame < 300; ++frame) {
      std::vector<TileId> needed;
      for (int i = static_cast<int>(rng() % (slots + 3)); i > 0; --i) needed.emplace_back(int(rng() % 3), rng() % 30);
      const auto before = mirror;
      table.begin_frame(frame, needed);
      std::set<TileId> granted;
      for (const auto tile : needed) {
        const auto slot = table.insert(tile);
        if (slot == kNoSlot) continue;
        granted.insert(tile);
        needed_at[tile] = frame;
        if (before.contains(tile)) {
          ASSERT_EQ(before.at(tile), slot) << "a resident tile moved";
        }
      }
      for (const auto& edit : table.take_edits()) {
        if (edit.slot == kNoSlot) {
          ASSERT_EQ(mirror.erase(edit.tile), 1u);
        } else {
          mirror[edit.tile] = edit.slot;
        }
      }
      const std::set<TileId> wanted(needed.begin(), needed.end());
      ASSERT_EQ(granted.size(), std::min(wanted.size(), slots)) << "refused although a slot could be had";
      std::set<SlotIndex> used;
      for (const auto& [tile, slot] : mirror) {
        ASSERT_LT(slot, slots);
        ASSERT_TRUE(used.insert(slot).second) << "two tiles in one slot";
        ASSERT_EQ(table.slot_of(tile), slot);
        ASSERT_EQ(table.tile_in(slot), tile);
      }
      ASSERT_EQ(mirror.size(), table.size());
      for (const auto& [tile, slot] : before) {
        if (mirror.contains(tile)) continue;
        ASSERT_FALSE(granted.contains(tile));
        for (const auto& [kept, at] : before) {
          if (mirror.contains(kept) && !granted.contains(kept)) {
            ASSERT_LE(needed_at[tile], needed_at[kept]) << "a tile went that was needed later than one that stayed";
          }
        }
      }
    }
  }
}

TEST(PageTable, WholeTableEqualsTheSumOfItsEdits) {
  PageTable table(3);
  const std::vector<TileId> first{TileId(0, 1), TileId(0, 2)};
  table.begin_frame(1, first);
  for (const auto t : first) table.insert(t);
  EXPECT_EQ(table.take_edits(), table.whole());
  EXPECT_TRUE(table.take_edits().empty());
}

}  // namespace
}  // namespace darm::tile_scheduler
