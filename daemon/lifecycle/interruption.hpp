// A long command that a signal ends: it is told, goes on to a place where nothing is lost, and says so.
#pragma once

#include <atomic>
#include <string>

#include "daemon/lifecycle/stop_count.hpp"
#include "daemon/lifecycle/stop_signals.hpp"

namespace darm::lifecycle {

/// Make it first thing in a command, before any other thread. A second signal leaves at once, in words.
class Interruption {
 public:
  /// `name` begins what is said.
  explicit Interruption(std::string name);
  [[nodiscard]] bool asked() const { return asked_.load(); }

 private:
  void on_signal();
  std::string name_;
  StopCount count_;  // of the signals' thread
  std::atomic<bool> asked_{false};
  StopSignals signals_;  // last: it calls the others
};

}  // namespace darm::lifecycle
