// What an actor may ask of the world: pool work, timers and the clock. Thread-safe.
#pragma once

#include <chrono>
#include <functional>

namespace darm::runtime {

/// Which of the pool's three queues work waits in. A higher queue is emptied before a lower one is looked at.
enum class Priority { kHigh, kNormal, kLow };

/// Pool, timer and clock behind one interface, so that a test can put a single thread and a manual clock in their
/// place. Work that is still queued when the system shuts down is destroyed without being run; work must therefore own
/// what it touches (shared_ptr, Ref), never point into the actor that posted it.
class Executor {
 public:
  virtual ~Executor() = default;
  /// Runs `work` once on a pool thread: a slice of a few milliseconds. An exception is a failure of the actor "pool".
  virtual void post(Priority priority, std::function<void()> work) = 0;
  /// Runs `work` once after `delay` on the timer thread: keep it to a `tell` or a `post`. Negative delays are zero.
  virtual void after(std::chrono::microseconds delay, std::function<void()> work) = 0;
  /// The steady clock (manual in tests).
  [[nodiscard]] virtual std::chrono::steady_clock::time_point now() const = 0;
  /// Processor time of the calling thread so far: only differences taken on one thread mean anything. (In tests the
  /// manual clock's.)
  [[nodiscard]] virtual std::chrono::microseconds thread_time() const = 0;
  /// Pool threads, at least 1.
  [[nodiscard]] virtual unsigned workers() const = 0;
};

}  // namespace darm::runtime
