// Bytes that many sessions send: made once, shared, never changed.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

namespace darm::session {

using Bytes = std::vector<std::uint8_t>;
using SharedBytes = std::shared_ptr<const Bytes>;

/// What one write gives to a socket: `head`, then `body` (may be null), then `tail`.
struct Packet {
  Bytes head;
  SharedBytes body;
  Bytes tail;
  [[nodiscard]] std::size_t size() const { return head.size() + (body ? body->size() : 0) + tail.size(); }
};

}  // namespace darm::session
