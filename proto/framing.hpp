// Envelopes on a byte stream: 4-byte big-endian length, then one serialized Envelope. No sockets here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <expected>
#include <span>
#include <string>
#include <vector>

namespace darm::wire {
class Envelope;
}

namespace darm::proto {

/// Cuts a byte stream into Envelopes. Feed what the socket gave, then call `next` until it says false.
/// Holds at most one announced message and one fed piece; a length over the limit is refused when its four bytes are
/// known, before any memory for it. After an error every call gives the same error: the stream cannot be resumed.
class FrameReader {
 public:
  explicit FrameReader(std::size_t max_message_bytes) : limit_(max_message_bytes) {}

  void feed(std::span<const std::uint8_t> bytes);

  /// True: `out` holds the next Envelope. False: more bytes are needed. Error: one line for a person.
  [[nodiscard]] std::expected<bool, std::string> next(wire::Envelope& out);

  /// Bytes held and not yet taken.
  [[nodiscard]] std::size_t buffered() const { return buffer_.size() - begin_; }

 private:
  void check_length();

  std::size_t limit_;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;  // first byte not yet taken
  std::string error_;      // empty: in order
};

/// The bytes of one Envelope with its length in front. The Envelope must be under 2 GiB.
[[nodiscard]] std::vector<std::uint8_t> frame(const wire::Envelope& envelope);

/// The length prefix alone, for callers that have the serialized bytes in pieces.
void put_length(std::uint32_t length, std::uint8_t* out4);

}  // namespace darm::proto
