// Authenticated UDP datagrams. No sockets here.
#pragma once

#include <cstdint>
#include <expected>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/siphash.hpp"

namespace darm::wire {
class DatagramBody;
}

namespace darm::proto {

/// The part of Welcome.key that authenticates datagrams (its first 16 bytes); nothing if the key is too short.
[[nodiscard]] std::optional<SipKey> datagram_key(std::string_view welcome_key);

/// Tag over session (8 bytes LE), sequence (8 bytes LE) and payload.
[[nodiscard]] SipTag datagram_tag(const SipKey& key, std::uint64_t session, std::uint64_t sequence,
                                  std::string_view payload);

/// Equal in a time that does not depend on where they differ. False for a wrong length.
[[nodiscard]] bool tags_equal(const SipTag& expected, std::string_view given);

/// A serialized Datagram, ready to send. `sequence` starts at 1 and must rise with every datagram of the session.
[[nodiscard]] std::vector<std::uint8_t> seal_datagram(const SipKey& key, std::uint64_t session, std::uint64_t sequence,
                                                      const wire::DatagramBody& body);

/// Why a datagram was dropped.
enum class DatagramFault : std::uint8_t { kTooLong, kGarbage, kForged, kReplayed };
[[nodiscard]] std::string_view to_string(DatagramFault fault);

/// The session number a datagram claims, to find the key by; nothing for garbage. Not yet authenticated.
[[nodiscard]] std::optional<std::uint64_t> claimed_session(std::span<const std::uint8_t> bytes);

/// Receiving end of one session's datagrams. Newest wins: a sequence at or below the last good one is dropped.
class DatagramGate {
 public:
  DatagramGate(const SipKey& key, std::uint64_t session) : key_(key), session_(session) {}

  /// On success `body` is filled. The sequence is taken once the tag is good, even if the body then is not.
  [[nodiscard]] std::expected<void, DatagramFault> open(std::span<const std::uint8_t> bytes, wire::DatagramBody& body);

 private:
  SipKey key_;
  std::uint64_t session_;
  std::uint64_t newest_ = 0;
};

}  // namespace darm::proto
