// Accepts clients over TCP and gives each a session actor.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "actors/session/session_actor.hpp"
#include "actors/types/error.hpp"

namespace boost::asio {
class io_context;
namespace ssl {
class context;
}
}  // namespace boost::asio

namespace darm::session {

struct TcpListenerOptions {
  std::string address = "0.0.0.0";
  std::uint16_t port = 0;                          ///< 0: the system chooses
  unsigned max_sessions = 64;                      ///< one more hears SERVER_FULL
  std::size_t mailbox = 256;                       ///< of each session
  std::shared_ptr<boost::asio::ssl::context> tls;  ///< clients may speak TLS on the same port; null: they may not
  std::size_t max_pending = 256;                   ///< sockets at a time whose first byte or handshake is awaited (TLS)
};

/// Runs on the threads of `io`, which belong to the daemon.
class TcpListener {
 public:
  /// `system` must outlive the listener and `io` must be run by somebody. Error: the address cannot be bound.
  [[nodiscard]] static Result<std::unique_ptr<TcpListener>> open(boost::asio::io_context& io, runtime::System& system,
                                                                 std::shared_ptr<SessionSurroundings> surroundings,
                                                                 const TcpListenerOptions& options);
  /// stop().
  ~TcpListener();
  /// The port that is bound.
  [[nodiscard]] std::uint16_t port() const;
  /// Accepts no more; sessions go on. Thread-safe, idempotent. Blocks for nobody.
  void stop();

 private:
  struct State;
  explicit TcpListener(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

}  // namespace darm::session
