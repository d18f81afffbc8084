// The running service: owns every thread, every actor and every listener.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "actors/types/error.hpp"
#include "daemon/config/config.hpp"
#include "daemon/world.hpp"

namespace darm {

/// Bound addresses of a running daemon.
struct Addresses {
  std::uint16_t tcp = 0;
  std::uint16_t udp = 0;
  std::string metrics_url;      ///< empty: off
  std::uint16_t web = 0;        ///< 0: off
  std::string tls_fingerprint;  ///< SHA-256 of the certificate; empty: no TLS
  bool certificate_is_ours = false;
};

/// Composition root. start() once, stop() once, from the same thread.
class Daemon {
 public:
  explicit Daemon(const config::Config& config, std::uint64_t seed);
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  /// Loads the world, spawns the actors and opens the listeners. `on_fatal` is called, from any thread, when an actor
  /// whose failure the daemon cannot survive has failed; it should lead to stop().
  [[nodiscard]] Result<Addresses> start(const std::function<void(const std::string&)>& on_fatal);

  /// Says in the log, once each, what an operator should know of the radiance store: that it is full, that tiles of it
  /// were refused. Call it every second or so.
  void report_store();
  /// Brings the metrics of the light's effects up to date. Call it every second or so.
  void report_effects();

  /// Refuses new clients, says goodbye, finishes slices, writes the store, joins. Returns false if something was late:
  /// the process should then leave by std::_Exit.
  [[nodiscard]] bool stop(std::chrono::milliseconds deadline);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace darm
