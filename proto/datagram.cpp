#include "proto/datagram.hpp"

#include <algorithm>

#include "proto/darm.pb.h"
#include "proto/limits.hpp"

namespace darm::proto {
namespace {

void append_le(std::vector<std::uint8_t>& out, std::uint64_t value) {
  for (int i = 0; i < 8; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

}  // namespace

std::optional<SipKey> datagram_key(std::string_view welcome_key) {
  static_assert(kDatagramKeyBytes == sizeof(SipKey));
  if (welcome_key.size() < kDatagramKeyBytes) return std::nullopt;
  SipKey key;
  for (std::size_t i = 0; i < key.size(); ++i) key[i] = static_cast<std::uint8_t>(welcome_key[i]);
  return key;
}

SipTag datagram_tag(const SipKey& key, std::uint64_t session, std::uint64_t sequence, std::string_view payload) {
  std::vector<std::uint8_t> message;
  message.reserve(16 + payload.size());
  append_le(message, session);
  append_le(message, sequence);
  message.insert(message.end(), payload.begin(), payload.end());
  return siphash_2_4_128(key, message);
}

bool tags_equal(const SipTag& expected, std::string_view given) {
  if (given.size() != expected.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    difference |= static_cast<unsigned>(expected[i] ^ static_cast<std::uint8_t>(given[i]));
  }
  return difference == 0;
}

std::vector<std::uint8_t> seal_datagram(const SipKey& key, std::uint64_t session, std::uint64_t sequence,
                                        const wire::DatagramBody& body) {
  wire::Datagram datagram;
  datagram.set_session(session);
  datagram.set_sequence(sequence);
  datagram.set_payload(body.SerializeAsString());
  const auto tag = datagram_tag(key, session, sequence, datagram.payload());
  datagram.set_tag(tag.data(), tag.size());
  std::vector<std::uint8_t> bytes(datagram.ByteSizeLong());
  datagram.SerializeWithCachedSizesToArray(bytes.data());
  return bytes;
}

std::string_view to_string(DatagramFault fault) {
  switch (fault) {
    case DatagramFault::kTooLong:
      return "too_long";
    case DatagramFault::kGarbage:
      return "garbage";
    case DatagramFault::kForged:
      return "forged";
    case DatagramFault::kReplayed:
      return "replayed";
  }
  return "unknown";
}

std::optional<std::uint64_t> claimed_session(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > kMaxDatagram) return std::nullopt;
  wire::Datagram datagram;
  if (!datagram.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return std::nullopt;
  if (datagram.session() == 0) return std::nullopt;
  return datagram.session();
}

std::expected<void, DatagramFault> DatagramGate::open(std::span<const std::uint8_t> bytes, wire::DatagramBody& body) {
  if (bytes.size() > kMaxDatagram) return std::unexpected(DatagramFault::kTooLong);
  wire::Datagram datagram;
  if (!datagram.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return std::unexpected(DatagramFault::kGarbage);
  }
  const auto tag = datagram_tag(key_, session_, datagram.sequence(), datagram.payload());
  if (datagram.session() != session_ || !tags_equal(tag, datagram.tag())) {
    return std::unexpected(DatagramFault::kForged);
  }
  if (datagram.sequence() <= newest_) return std::unexpected(DatagramFault::kReplayed);
  newest_ = datagram.sequence();
  if (!body.ParseFromString(datagram.payload()) || body.body_case() == wire::DatagramBody::BODY_NOT_SET) {
    return std::unexpected(DatagramFault::kGarbage);
  }
  return {};
}

}  // namespace darm::proto
