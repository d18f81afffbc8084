// The session's end of a byte stream, free of any networking library, so that a test can put a script in its place.
#pragma once

#include "actors/runtime/actor.hpp"
#include "actors/session/bytes.hpp"
#include "actors/session/session_messages.hpp"

namespace darm::session {

/// Calls return at once; what comes of them arrives as messages at `owner`: BytesReceived for a read, BytesSent for a
/// write, SocketClosed once for the end of either.
class Connection {
 public:
  virtual ~Connection() = default;
  /// Names who is told. Once, before anything else.
  virtual void attach(runtime::Ref<Inbox> owner) = 0;
  /// Reads the next piece. One read at a time.
  virtual void read() = 0;
  /// Writes all of `packets`, which are not empty, then tells BytesSent once. One write at a time.
  virtual void write(Packets packets) = 0;
  /// Ends the stream; what was written is still delivered if the other side reads. Idempotent.
  virtual void close() = 0;
};

}  // namespace darm::session
