// Receives cameras and control datagrams for all sessions.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "actors/session/session_actor.hpp"
#include "actors/types/error.hpp"

namespace boost::asio {
class io_context;
}

namespace darm::session {

/// Authenticates each datagram and hands it to its session; what is forged, replayed or garbage is counted and dropped
/// without an answer. Runs on the threads of `io`. Sends nothing.
class UdpListener {
 public:
  /// Binds and enters its port into `surroundings->udp_port`. Open it before the TCP listener, so that every Welcome
  /// names it. `port` 0: the system chooses.
  [[nodiscard]] static Result<std::unique_ptr<UdpListener>> open(boost::asio::io_context& io,
                                                                 std::shared_ptr<SessionSurroundings> surroundings,
                                                                 const std::string& address, std::uint16_t port);
  ~UdpListener();
  [[nodiscard]] std::uint16_t port() const;
  /// Thread-safe, idempotent.
  void stop();

 private:
  struct State;
  explicit UdpListener(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

}  // namespace darm::session
