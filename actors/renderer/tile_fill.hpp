// Gives texels that nobody has shaded the value of their nearest shaded neighbours: first within a patch, then any.
#pragma once

#include <array>
#include <cstdint>

#include "actors/renderer/tile_surface.hpp"
#include "actors/types/tile_id.hpp"

namespace darm::renderer {

/// Breadth-first dilation over a slot's 32x32 texels: each wave is the mean of what earlier waves reached.
/// A slot without a single known texel stays zero.
template <int Channels>
struct SlotFill {
  using Value = std::array<float, Channels>;
  std::array<Value, kSlotTexels> value{};
  std::array<std::uint32_t, kSlotTexels> patch;
  std::array<bool, kSlotTexels> known{};

  SlotFill() { patch.fill(kNobody); }
  void set(int at, const Value& v) {
    value[static_cast<std::size_t>(at)] = v;
    known[static_cast<std::size_t>(at)] = true;
  }
  void run() {
    spread(true);
    spread(false);
  }
  /// Within patches first; patches without a known texel then have the mean of the slot's known ones, as `neutral`
  /// makes it of that; what is nobody's comes last.
  template <class F>
  void run_neutral(F&& neutral) {
    Value sum{};
    float n = 0;
    for (std::size_t at = 0; at < value.size(); ++at) {
      if (!known[at]) continue;
      for (std::size_t c = 0; c < Channels; ++c) sum[c] += value[at][c];
      n += 1;
    }
    spread(true);
    if (n > 0) {
      for (auto& c : sum) c /= n;
      const Value mean = neutral(sum);
      for (std::size_t at = 0; at < value.size(); ++at)
        if (!known[at] && patch[at] != kNobody) set(static_cast<int>(at), mean);
    }
    spread(false);
  }
  /// Gives each known texel of `which` the mean of the known ones beside it that are of its patch and not of `which`;
  /// it keeps its value where there is none.
  void replace_by_neighbours(const std::array<bool, kSlotTexels>& which) {
    for (std::size_t at = 0; at < which.size(); ++at) {
      if (!which[at] || !known[at]) continue;
      Value sum{};
      float n = 0;
      each_neighbour(static_cast<int>(at), [&](std::size_t, std::size_t from) {
        if (!known[from] || which[from] || patch[from] != patch[at]) return;
        for (std::size_t c = 0; c < Channels; ++c) sum[c] += value[from][c];
        n += 1;
      });
      if (n == 0) continue;
      for (auto& c : sum) c /= n;
      value[at] = sum;
    }
  }
  /// Within patches only: what has no known texel of its own patch stays zero.
  void run_within_patches() { spread(true); }

 private:
  void spread(bool same_patch_only) {
    std::array<std::uint16_t, kSlotTexels> queue;
    std::array<bool, kSlotTexels> reached = known;
    int head = 0;
    int tail = 0;
    for (int at = 0; at < kSlotTexels; ++at)
      if (known[static_cast<std::size_t>(at)]) queue[static_cast<std::size_t>(tail++)] = static_cast<std::uint16_t>(at);
    while (head < tail) {
      const int wave_end = tail;
      for (; head < wave_end; ++head)
        each_neighbour(queue[static_cast<std::size_t>(head)], [&](std::size_t from, std::size_t to) {
          if (reached[to] || (same_patch_only && (patch[from] != patch[to] || patch[to] == kNobody))) return;
          reached[to] = true;
          queue[static_cast<std::size_t>(tail++)] = static_cast<std::uint16_t>(to);
        });
      for (int i = wave_end; i < tail; ++i) settle(queue[static_cast<std::size_t>(i)], same_patch_only);
      for (int i = wave_end; i < tail; ++i) known[queue[static_cast<std::size_t>(i)]] = true;
    }
  }

  void settle(int at, bool same_patch_only) {
    Value sum{};
    float n = 0;
    each_neighbour(at, [&](std::size_t to, std::size_t from) {
      if (!known[from] || (same_patch_only && patch[from] != patch[to])) return;
      for (std::size_t c = 0; c < Channels; ++c) sum[c] += value[from][c];
      n += 1;
    });
    for (auto& c : sum) c /= n;  // reached from a known neighbour, so n >= 1
    value[static_cast<std::size_t>(at)] = sum;
  }

  template <class F>
  static void each_neighbour(int at, F&& f) {
    const int x = at % kSlotSize;
    const int y = at / kSlotSize;
    for (int dy = y > 0 ? -1 : 0; dy <= (y < kSlotSize - 1 ? 1 : 0); ++dy)
      for (int dx = x > 0 ? -1 : 0; dx <= (x < kSlotSize - 1 ? 1 : 0); ++dx)
        if (dx != 0 || dy != 0) f(static_cast<std::size_t>(at), static_cast<std::size_t>(at + dy * kSlotSize + dx));
  }
};

}  // namespace darm::renderer
