// The system of tests: one thread, a manual clock, everything in the order it was asked for.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "actors/runtime/system.hpp"

namespace darm::runtime {

/// Nothing happens until run_until_idle() or advance(). Each turn handles one message; actors with mail take turns in
/// the order in which their mail came. Pool work waits in three queues like in the real pool and runs, one piece at a
/// time, whenever no actor has a turn. Timers fire in order of time (then of being set). Single-threaded.
class DeterministicSystem final : public System {
 public:
  struct Handled {
    std::string actor;
    std::string message;  ///< unqualified type name; "start" and "stop" are not in the log
    bool operator==(const Handled&) const = default;
  };

  /// `workers`: what executor().workers() says. `metrics` must outlive the system.
  explicit DeterministicSystem(unsigned workers = 1, MetricSink* metrics = nullptr);
  ~DeterministicSystem() override;

  /// Turns and pool work until there are none; timers that are due fire. Returns the number of steps.
  /// Throws std::runtime_error after `max_steps`: actors that feed each other for ever.
  std::size_t run_until_idle(std::size_t max_steps = 1'000'000);
  /// Moves the clock on, firing timers on the way, each followed by run_until_idle().
  void advance(std::chrono::microseconds duration);
  /// Who handled what, in order.
  [[nodiscard]] const std::vector<Handled>& messages_log() const;
  void clear_log();
  /// Failures so far (handlers or work that threw), after the supervisor's table was applied.
  [[nodiscard]] const std::vector<Failure>& failures() const;
  /// Timers that have not fired yet.
  [[nodiscard]] std::size_t pending_timers() const;

 private:
  class Core;
  std::shared_ptr<Host> host() override;
  bool admit(const std::shared_ptr<CellBase>& cell) override;

  std::shared_ptr<Core> core_;
};

}  // namespace darm::runtime
