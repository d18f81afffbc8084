// Accepts sockets on one address, through errors that pass.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "actors/runtime/metrics.hpp"
#include "actors/types/error.hpp"

namespace boost::asio {
class io_context;
}

namespace darm::session {

/// Gives each socket a strand of its own. An accept that fails (no file descriptors left) is tried again with back-off;
/// a broken socket is opened anew on the same port.
class SocketAcceptor {
 public:
  using OnSocket = std::function<void(boost::asio::ip::tcp::socket)>;

  /// `name` begins error messages ("tcp", "web"). `on_socket` runs on the threads of `io`, one call at a time, until
  /// stop(). Error: the address cannot be bound.
  [[nodiscard]] static Result<std::unique_ptr<SocketAcceptor>> open(boost::asio::io_context& io,
                                                                    const std::string& name, const std::string& address,
                                                                    std::uint16_t port, runtime::MetricSink& metrics,
                                                                    OnSocket on_socket);
  /// stop().
  ~SocketAcceptor();
  SocketAcceptor(const SocketAcceptor&) = delete;
  SocketAcceptor& operator=(const SocketAcceptor&) = delete;
  /// The port that is bound.
  [[nodiscard]] std::uint16_t port() const;
  /// Accepts no more. Thread-safe, idempotent. Blocks for nobody.
  void stop();

 private:
  struct State;
  explicit SocketAcceptor(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

}  // namespace darm::session
