// A seeded generator whose numbers are 32 bits wide on every platform.
#pragma once

#include <cstdint>
#include <random>

namespace darm::tile_scheduler::testing {

class Random {
 public:
  using result_type = std::uint32_t;
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  std::uint32_t operator()() { return static_cast<std::uint32_t>(engine_()); }
  static constexpr std::uint32_t min() { return 0; }
  static constexpr std::uint32_t max() { return 0xffffffffu; }

 private:
  std::mt19937 engine_;
};

}  // namespace darm::tile_scheduler::testing
