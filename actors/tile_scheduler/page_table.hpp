// Which tile is in which slot of a PhysTex. Pure; one per stream.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "actors/types/ids.hpp"
#include "actors/types/tile_id.hpp"

namespace darm::tile_scheduler {

/// A change of the table: `tile` is now in `slot`, or absent (kNoSlot). Applied in order.
struct TableEdit {
  TileId tile;
  SlotIndex slot = kNoSlot;
  bool operator==(const TableEdit&) const = default;
};

/// Slots and tiles, one to one. A tile keeps its slot until it is the least recently seen one and a slot is needed.
class PageTable {
 public:
  /// `slots`: 1..65535 (kNoSlot is no slot).
  explicit PageTable(std::size_t slots);

  [[nodiscard]] std::size_t capacity() const { return slots_.size(); }
  [[nodiscard]] std::size_t size() const { return where_.size(); }
  [[nodiscard]] SlotIndex slot_of(TileId tile) const;
  [[nodiscard]] std::optional<TileId> tile_in(SlotIndex slot) const;
  [[nodiscard]] std::vector<TileId> residents() const;

  /// Starts frame `frame` (increasing) and says that these tiles are needed in it: until the next call they stay.
  void begin_frame(std::uint64_t frame, std::span<const TileId> needed);
  /// Gives a tile a slot: its own, a free one, or that of the least recently needed tile. kNoSlot if all are needed
  /// now.
  SlotIndex insert(TileId tile);
  /// Changes since the last call, in order.
  [[nodiscard]] std::vector<TableEdit> take_edits();
  /// The whole table as edits, by slot.
  [[nodiscard]] std::vector<TableEdit> whole() const;

 private:
  struct Slot {
    std::optional<TileId> tile;
    std::uint64_t needed = 0;  // frame in which it was last needed
    SlotIndex older = kNoSlot;
    SlotIndex newer = kNoSlot;
  };
  void unlink(SlotIndex slot);
  void link_newest(SlotIndex slot);

  std::vector<Slot> slots_;
  std::vector<SlotIndex> free_;  // the lowest slot is last
  std::unordered_map<TileId, SlotIndex> where_;
  std::vector<TableEdit> edits_;
  SlotIndex oldest_ = kNoSlot;
  SlotIndex newest_ = kNoSlot;
  std::uint64_t frame_ = 0;
};

}  // namespace darm::tile_scheduler
