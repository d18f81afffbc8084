// What a stop signal asks for, by those that came before it. Pure.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace darm::lifecycle {

/// What a process that a signal ended exits with, as shells have it.
inline constexpr int kInterrupted = 130;

/// The first signal asks for a stop, a later one to leave at once. Programs that stop others often send the same wish
/// twice within moments (timeout sends to the process and then to its group; a terminal that is closed hangs up and
/// terminates): that is one wish.
class StopCount {
 public:
  enum class Wish : std::uint8_t { kStop, kNothingNew, kLeave };
  static constexpr std::chrono::milliseconds kSameWish{1000};

  [[nodiscard]] Wish signal(std::chrono::steady_clock::time_point now) {
    if (!first_) {
      first_ = now;
      return Wish::kStop;
    }
    return now - *first_ < kSameWish ? Wish::kNothingNew : Wish::kLeave;
  }

 private:
  std::optional<std::chrono::steady_clock::time_point> first_;
};

}  // namespace darm::lifecycle
