// SIGINT and SIGTERM as calls on a thread of their own, where anything may be done.
#pragma once

#include <functional>
#include <thread>

namespace darm::lifecycle {

/// Make one first thing in main, before any other thread: it blocks the signals for the process's threads, which
/// inherit the mask. SIGPIPE is ignored (a closed socket is an error value), SIGHUP counts as a stop.
class StopSignals {
 public:
  /// `on_signal(number)` is called for each signal, one at a time; the second one usually means "now".
  explicit StopSignals(std::function<void(int)> on_signal);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  void run();
  std::function<void(int)> on_signal_;
  int signals_ = -1;  // signalfd
  int ended_ = -1;    // eventfd: the destructor's word to the thread
  std::thread thread_;
};

}  // namespace darm::lifecycle
