// One thread that runs short closures at their time.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>

namespace darm::runtime {

/// Thread-safe but for close(), which is called from outside of the thread.
class TimerThread {
 public:
  explicit TimerThread(std::function<void(const std::string&)> on_exception);
  ~TimerThread();
  /// Runs `work` at `when`; the same time runs in order of the calls. After close() the work is dropped.
  void at(std::chrono::steady_clock::time_point when, std::function<void()> work);
  /// Drops what waits and refuses more.
  void close();
  /// After close(): true if the thread has ended and is joined.
  bool join_until(std::chrono::steady_clock::time_point deadline);

 private:
  void run();

  std::function<void(const std::string&)> on_exception_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::condition_variable left_;
  std::multimap<std::chrono::steady_clock::time_point, std::function<void()>> timers_;
  bool closed_ = false;
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace darm::runtime
