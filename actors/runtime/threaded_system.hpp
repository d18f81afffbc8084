// The system of the daemon: threads for actor turns, a pool for long work, a timer. Threads belong to it alone.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "actors/runtime/system.hpp"

namespace darm::runtime {

struct ThreadedOptions {
  unsigned workers = 0;           ///< pool threads; 0: one per core that this process may use
  unsigned actor_threads = 2;     ///< threads for actor turns, apart from the pool: a handler never waits for a slice
  int worker_nice = 10;           ///< added to the niceness of pool threads, 0..19, so that actors and sockets go first
  MetricSink* metrics = nullptr;  ///< must outlive the system; null: none
};

class ThreadedSystem final : public System {
 public:
  explicit ThreadedSystem(ThreadedOptions options = {});
  /// shutdown() with no deadline, if it has not been called.
  ~ThreadedSystem() override;

  /// Refuses new actors and messages, lets each running handler and pool slice finish, destroys all actors on their own
  /// turns, drops queued work and timers, and joins. Returns the names of those who were not done at the deadline
  /// (empty: all threads are joined). After a late one the process should log the names and leave by std::_Exit: the
  /// destructor would wait for them. Call it from outside the system's threads, once.
  std::vector<std::string> shutdown(std::chrono::milliseconds deadline);

 private:
  class Core;
  std::shared_ptr<Host> host() override;
  bool admit(const std::shared_ptr<CellBase>& cell) override;

  std::shared_ptr<Core> core_;
};

}  // namespace darm::runtime
