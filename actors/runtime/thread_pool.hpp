// The pool for long work: threads at lower niceness behind three priority queues.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "actors/runtime/executor.hpp"

namespace darm::runtime {

/// Cores this process may run on (its affinity mask), at least 1.
[[nodiscard]] unsigned usable_cores();

/// Runs closures on its threads. Thread-safe but for close(), which is called once, from outside of the pool.
class ThreadPool {
 public:
  using Work = std::function<void()>;
  /// `on_exception(what)` is called on the pool's thread for work that threw. `name` shows in `top -H`.
  ThreadPool(const std::string& name, unsigned threads, int niceness,
             std::function<void(const std::string&)> on_exception);
  ~ThreadPool();

  /// After close() the work is dropped.
  void post(Priority priority, Work work);
  [[nodiscard]] unsigned threads() const { return static_cast<unsigned>(threads_.size()); }
  /// Drops queued work and refuses more; running work goes on.
  void close();
  /// After close(): waits for running work; true if all threads are joined, else how many are busy is `busy()`.
  bool join_until(std::chrono::steady_clock::time_point deadline);
  [[nodiscard]] unsigned busy() const;

 private:
  void run(int niceness);
  bool take(Work& work);

  std::function<void(const std::string&)> on_exception_;
  mutable std::mutex mutex_;
  std::condition_variable has_work_;
  std::condition_variable thread_left_;
  std::array<std::deque<Work>, 3> queues_;
  bool closed_ = false;
  unsigned busy_ = 0;
  unsigned running_threads_ = 0;
  std::vector<std::thread> threads_;
};

}  // namespace darm::runtime
