#include "daemon/lifecycle/stop_deadline.hpp"

#include <cstdlib>
#include <utility>

namespace darm::lifecycle {

StopDeadline::StopDeadline(std::chrono::milliseconds limit, std::function<void()> on_late,
                           std::function<void()> leave) {
  if (!leave) leave = [] { std::_Exit(1); };
  thread_ = std::thread([this, limit, on_late = std::move(on_late), leave = std::move(leave)] {
    std::unique_lock lock(mutex_);
    if (done_changed_.wait_for(lock, limit, [this] { return done_; })) return;
    lock.unlock();
    if (on_late) on_late();
    leave();
  });
}

StopDeadline::~StopDeadline() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  done_changed_.notify_all();
  thread_.join();
}

}  // namespace darm::lifecycle
