// A hash index from keys to dense numbers 0, 1, 2, ... in order of first insertion. Open addressing: the sets of a view
// are merged and searched a hundred thousand times a frame, where std::unordered_map costs several milliseconds.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace darm::tile_scheduler {

template <class Key, class Hash>
class DenseIndex {
 public:
  static constexpr std::uint32_t kAbsent = 0xffffffffu;

  /// Number of `key`, existing or new (then it equals the old size()).
  std::uint32_t insert(const Key& key) {
    if ((keys_.size() + 1) * 2 > table_.size()) grow();
    for (std::size_t at = Hash{}(key)&mask();; at = (at + 1) & mask()) {
      const auto number = table_[at];
      if (number == kAbsent) {
        table_[at] = static_cast<std::uint32_t>(keys_.size());
        keys_.push_back(key);
        return table_[at];
      }
      if (keys_[number] == key) return number;
    }
  }

  /// Number of `key`, or kAbsent.
  [[nodiscard]] std::uint32_t find(const Key& key) const {
    if (table_.empty()) return kAbsent;
    for (std::size_t at = Hash{}(key)&mask();; at = (at + 1) & mask()) {
      const auto number = table_[at];
      if (number == kAbsent || keys_[number] == key) return number;
    }
  }

  [[nodiscard]] const std::vector<Key>& keys() const { return keys_; }
  [[nodiscard]] std::size_t size() const { return keys_.size(); }
  void clear() {
    keys_.clear();
    std::fill(table_.begin(), table_.end(), kAbsent);
  }
  void reserve(std::size_t count) {
    keys_.reserve(count);
    if (count * 2 > table_.size()) rehash(std::bit_ceil(count * 2));
  }

 private:
  [[nodiscard]] std::size_t mask() const { return table_.size() - 1; }
  void grow() { rehash(std::max<std::size_t>(64, table_.size() * 2)); }
  void rehash(std::size_t size) {
    table_.assign(size, kAbsent);
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      std::size_t at = Hash{}(keys_[i]) & mask();
      while (table_[at] != kAbsent) at = (at + 1) & mask();
      table_[at] = static_cast<std::uint32_t>(i);
    }
  }

  std::vector<std::uint32_t> table_;  // size is a power of two, at most half full
  std::vector<Key> keys_;
};

/// Finaliser of a 64-bit mix (Stafford's variant 13 of MurmurHash3's): every input bit reaches the low bits.
struct MixHash {
  [[nodiscard]] static std::size_t mix(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return static_cast<std::size_t>(x ^ (x >> 31));
  }
};

}  // namespace darm::tile_scheduler
