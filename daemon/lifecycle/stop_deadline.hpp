// A stop that hangs must still end: after the deadline the process leaves without waiting.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace darm::lifecycle {

/// Armed on construction. If it is not destroyed within `limit`, `on_late` runs on its thread (log who is late) and
/// then `leave` (std::_Exit(1) unless a test says otherwise).
class StopDeadline {
 public:
  explicit StopDeadline(std::chrono::milliseconds limit, std::function<void()> on_late,
                        std::function<void()> leave = {});
  ~StopDeadline();
  StopDeadline(const StopDeadline&) = delete;
  StopDeadline& operator=(const StopDeadline&) = delete;

 private:
  std::mutex mutex_;
  std::condition_variable done_changed_;
  bool done_ = false;
  std::thread thread_;
};

}  // namespace darm::lifecycle
