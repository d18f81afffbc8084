// What a full mailbox does with one more message. Each message type names its policy: `static constexpr auto
// kOverflow`.
#pragma once

#include <cstdint>

namespace darm::runtime {

enum class Overflow : std::uint8_t {
  kReject,       ///< the message is refused and `tell` returns false (commands)
  kDropOldest,   ///< the oldest message of the same type makes room (telemetry)
  kLatestOnly,   ///< at most one message of this type waits: a newer one replaces it in place
  kLatestByKey,  ///< like kLatestOnly, per value of the message's `key()` (an std::uint64_t)
};

}  // namespace darm::runtime
