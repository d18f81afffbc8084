// SIGINT and SIGTERM as calls on a thread of their own, where anything may be done.
#pragma once

#include <functional>
#include <thread>

namespace darm::lifecycle {

/// First thing in main, before any other thread, which inherits the mask: stop signals wait for a StopSignals. One that
/// comes while the command line is read would otherwise end the process without a word.
void hold_stop_signals();
/// For a command that a signal may end where it stands: those that wait do so now.
void release_stop_signals();

/// Make one first thing in a command, before any other thread: it holds the signals. SIGPIPE is ignored (a closed
/// socket is an error value). SIGHUP counts as a stop, but for a process that was started to ignore it (nohup).
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
