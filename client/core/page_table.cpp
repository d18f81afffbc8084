#include "client/core/page_table.hpp"

#include <algorithm>

namespace darm::client {

PageTable::PageTable(std::uint32_t tiles) {
  const std::uint32_t rows = std::max(1u, (tiles + kTableWidth - 1) / kTableWidth);
  slots_.assign(std::size_t{rows} * kTableWidth, kAbsent);
  dirty_.assign(rows, true);
}

void PageTable::set(std::uint32_t entry, std::uint16_t slot) {
  auto& place = slots_[entry];
  if (place == slot) return;
  if (place == kAbsent) ++resident_;
  if (slot == kAbsent) --resident_;
  place = slot;
  dirty_[entry / kTableWidth] = true;
}

void PageTable::clear() {
  for (std::size_t row = 0; row < dirty_.size(); ++row) {
    const auto begin = slots_.begin() + static_cast<std::ptrdiff_t>(row * kTableWidth);
    const auto end = begin + kTableWidth;
    if (std::any_of(begin, end, [](std::uint16_t s) { return s != kAbsent; })) dirty_[row] = true;
  }
  std::fill(slots_.begin(), slots_.end(), kAbsent);
  resident_ = 0;
}

std::vector<RowRange> PageTable::take_dirty_rows() {
  std::vector<RowRange> ranges;
  for (std::uint32_t row = 0; row < rows(); ++row) {
    if (!dirty_[row]) continue;
    if (!ranges.empty() && ranges.back().first + ranges.back().count == row) {
      ++ranges.back().count;
    } else {
      ranges.push_back({row, 1});
    }
    dirty_[row] = false;
  }
  return ranges;
}

}  // namespace darm::client
