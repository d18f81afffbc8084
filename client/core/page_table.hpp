// Which slot of PhysTex holds which tile: one linear table over all levels, kept as rows of a 2048-wide texture. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "client/core/scene_model.hpp"

namespace darm::client {

inline constexpr std::uint16_t kAbsent = 65535;

/// Rows [first, first + count) of the table texture changed.
struct RowRange {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
};

class PageTable {
 public:
  /// `tiles` entries (at most kMaxTableEntries), all absent.
  explicit PageTable(std::uint32_t tiles);

  [[nodiscard]] std::uint16_t slot(std::uint32_t entry) const { return slots_[entry]; }
  /// `entry` < number of tiles.
  void set(std::uint32_t entry, std::uint16_t slot);
  /// Every tile absent: what a key frame starts from.
  void clear();

  [[nodiscard]] std::uint32_t rows() const { return static_cast<std::uint32_t>(dirty_.size()); }
  /// rows() * kTableWidth values; the end of the last row is absent.
  [[nodiscard]] const std::uint16_t* data() const { return slots_.data(); }
  /// Rows changed since the last call (all of them at first), in order, joined where adjacent.
  [[nodiscard]] std::vector<RowRange> take_dirty_rows();
  [[nodiscard]] std::uint32_t resident() const { return resident_; }

 private:
  std::vector<std::uint16_t> slots_;
  std::vector<bool> dirty_;
  std::uint32_t resident_ = 0;
};

}  // namespace darm::client
