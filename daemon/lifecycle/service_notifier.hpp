// systemd's notification protocol (sd_notify(3)): datagrams on the socket named by NOTIFY_SOCKET, without libsystemd.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

namespace darm::lifecycle {

/// Without a NOTIFY_SOCKET every call does nothing. Thread-safe; never blocks; failures are ignored as sd_notify's are.
class ServiceNotifier {
 public:
  /// Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID, and takes them out of the environment of later children.
  /// Before other threads start.
  [[nodiscard]] static ServiceNotifier from_environment();
  /// `socket_path`: absolute, or "@name" for an abstract one; empty: off. `watchdog`: the service manager's limit.
  explicit ServiceNotifier(const std::string& socket_path, std::optional<std::chrono::microseconds> watchdog = {});
  ~ServiceNotifier();
  ServiceNotifier(ServiceNotifier&& other) noexcept;
  ServiceNotifier& operator=(ServiceNotifier&&) = delete;

  [[nodiscard]] bool active() const { return socket_ >= 0; }
  void ready(std::string_view status) const;   ///< READY=1: clients can connect
  void status(std::string_view status) const;  ///< one line for `systemctl status`
  void stopping() const;                       ///< STOPPING=1
  void watchdog() const;                       ///< WATCHDOG=1: still alive; call it from the loop that must not hang
  /// How often watchdog() is due (half of the limit); nothing if nobody watches.
  [[nodiscard]] std::optional<std::chrono::microseconds> watchdog_interval() const { return interval_; }

 private:
  void send(const std::string& state) const;
  int socket_ = -1;
  std::optional<std::chrono::microseconds> interval_;
};

}  // namespace darm::lifecycle
