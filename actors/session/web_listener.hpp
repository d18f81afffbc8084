// One port for the web: the client's files over HTTP and HTTPS, /healthz, and the stream as a WebSocket.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "actors/session/session_actor.hpp"
#include "actors/session/web_files.hpp"
#include "actors/types/error.hpp"

namespace boost::asio {
class io_context;
namespace ssl {
class context;
}
}  // namespace boost::asio

namespace darm::session {

struct WebListenerOptions {
  std::string address = "0.0.0.0";
  std::uint16_t port = 0;            ///< 0: the system chooses
  unsigned max_sessions = 64;        ///< one more hears SERVER_FULL
  std::size_t mailbox = 256;         ///< of each session
  std::size_t max_pending = 256;     ///< connections at a time that are not sessions
  std::vector<std::string> origins;  ///< besides this server's own pages: whose may open a stream
  WebFiles files;
  std::shared_ptr<boost::asio::ssl::context> tls;  ///< null: HTTP alone
};

/// Tells TLS from HTTP by the first byte. A WebSocket at kStreamPath carries one Envelope in one binary message and is
/// a session like one over TCP: the same limits, the same send queue. Requests are limited before memory is taken: 8
/// KiB of header, no body, 15 s to say it, 60 s between two. Runs on the threads of `io`.
class WebListener {
 public:
  /// `system` must outlive the listener and `io` must be run by somebody. Error: the address cannot be bound.
  [[nodiscard]] static Result<std::unique_ptr<WebListener>> open(boost::asio::io_context& io, runtime::System& system,
                                                                 std::shared_ptr<SessionSurroundings> surroundings,
                                                                 WebListenerOptions options);
  /// stop().
  ~WebListener();
  /// The port that is bound.
  [[nodiscard]] std::uint16_t port() const;
  /// Accepts no more and closes what is not a session; sessions go on. Thread-safe, idempotent. Blocks for nobody.
  void stop();

 private:
  struct State;
  explicit WebListener(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

}  // namespace darm::session
