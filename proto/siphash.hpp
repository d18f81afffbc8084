// SipHash-2-4 with 128-bit output: a keyed hash for short messages.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace darm::proto {

using SipKey = std::array<std::uint8_t, 16>;
using SipTag = std::array<std::uint8_t, 16>;

/// Aumasson and Bernstein, "SipHash: a fast short-input PRF" (2012), section 2, with the 128-bit finalisation of the
/// authors' reference. Unforgeable without the key; not a general-purpose hash.
[[nodiscard]] SipTag siphash_2_4_128(const SipKey& key, std::span<const std::uint8_t> message);

}  // namespace darm::proto
