// Bytes that many sessions send: made once, shared, never changed.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

namespace darm::session {

using Bytes = std::vector<std::uint8_t>;
using SharedBytes = std::shared_ptr<const Bytes>;

/// One message as a socket is given it: `head`, then `body` (may be null), then `tail`.
struct Packet {
  Bytes head;
  SharedBytes body;
  Bytes tail;
  [[nodiscard]] std::size_t size() const { return head.size() + (body ? body->size() : 0) + tail.size(); }
};

/// What is handed to a connection at once: whole messages, in order.
using Packets = std::vector<Packet>;

}  // namespace darm::session
