// The client's end of the wire: TCP for everything, UDP for cameras where the server offers it.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "client/core/byte_stream.hpp"
#include "client/core/result.hpp"
#include "client/core/view.hpp"
#include "proto/darm.pb.h"

namespace darm::client {

using Clock = std::chrono::steady_clock;

/// This client's clock as it travels in messages, microseconds.
[[nodiscard]] std::int64_t now_us();

struct ConnectOptions {
  std::string host;
  std::uint16_t port = 0;
  Tls tls = Tls::kNone;
  std::filesystem::path authority;  ///< PEM, for Tls::kVerified; empty: the system's alone
  std::string name = "darm client";
  std::optional<View> view;  ///< geometry comes nearest to it first
  std::uint32_t max_phystex = 2048;
  bool chroma_444 = true;
  bool lossless = false;
  float target_error = 0;                 ///< RMS display error with which it is content, 0..1; 0: the server's own
  std::uint32_t max_view_phystex = 1024;  ///< of the private layer; 0: light that does not depend on the eye alone
  std::uint64_t known_scene = 0;          ///< tag of a scene it has whole, manifest and geometry; 0: none
  std::stop_token stop;                   ///< ends opening early, with an error
  bool udp = true;                        ///< cameras by UDP where the server offers it; else by TCP, as from browsers
  bool measure_clock = false;             ///< ping once a second, for server_clock_ahead()
  std::chrono::milliseconds connect_timeout{5000};
  std::chrono::milliseconds handshake_timeout{20000};
  /// Nothing at all from the server for so long: it is taken for gone.
  std::chrono::milliseconds silence_timeout{30000};
  /// Received and not yet taken; beyond it the socket is left unread.
  std::size_t max_queued_bytes = std::size_t{1} << 30;
};

/// One message, and when and after how many bytes of the connection it had come.
struct Received {
  wire::Envelope envelope;
  std::int64_t at_us = 0;
  std::uint64_t bytes_total = 0;  ///< bytes of the TCP stream up to and with this message
  std::size_t bytes = 0;          ///< of this message
};

/// A session with a server, over TCP or TLS. One reader thread inside; the methods may be called from any thread. Pings
/// are answered and, when the owner sends nothing, sent from inside. The destructor says goodbye and joins.
class Connection {
 public:
  [[nodiscard]] static Result<std::unique_ptr<Connection>> open(const ConnectOptions& options);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  [[nodiscard]] const wire::Welcome& welcome() const;
  /// Next message (never Ping, Pong or Welcome); nullopt after `timeout`. Error once the queue is empty and the
  /// connection has ended: the server's goodbye (whose reason is its cause), its silence, a broken stream.
  [[nodiscard]] Result<std::optional<Received>> next(std::chrono::milliseconds timeout);
  /// Sends a camera; gives its sequence number (1, 2, ...), by which answers refer to it.
  [[nodiscard]] Result<std::uint64_t> send_camera(const View& view);
  [[nodiscard]] Result<void> send_feedback(const wire::Feedback& feedback);
  void goodbye();
  [[nodiscard]] std::uint64_t bytes_received() const;
  [[nodiscard]] std::uint64_t bytes_sent() const;
  [[nodiscard]] bool uses_udp() const;
  /// The server's clock (of its stamps) less this one, microseconds: of the ping that came back soonest, right to half
  /// of what its ways differ. Nothing before the first pong.
  [[nodiscard]] std::optional<std::int64_t> server_clock_ahead() const;

 private:
  struct State;
  explicit Connection(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// "host:port" or "[v6]:port".
[[nodiscard]] Result<void> parse_address(const std::string& text, std::string& host, std::uint16_t& port);

}  // namespace darm::client
