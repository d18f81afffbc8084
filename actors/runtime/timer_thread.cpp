#include "actors/runtime/timer_thread.hpp"

#include <pthread.h>

#include <exception>
#include <utility>

namespace darm::runtime {

TimerThread::TimerThread(std::function<void(const std::string&)> on_exception)
    : on_exception_(std::move(on_exception)), thread_([this] { run(); }) {
  pthread_setname_np(thread_.native_handle(), "timer");
}

TimerThread::~TimerThread() {
  close();
  if (thread_.joinable()) thread_.join();
}

void TimerThread::at(std::chrono::steady_clock::time_point when, std::function<void()> work) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    timers_.emplace(when, std::move(work));
  }
  changed_.notify_one();
}

void TimerThread::close() {
  decltype(timers_) dropped;  // destroyed after the lock is released
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    std::swap(dropped, timers_);
  }
  changed_.notify_one();
}

bool TimerThread::join_until(std::chrono::steady_clock::time_point deadline) {
  {
    std::unique_lock lock(mutex_);
    if (!left_.wait_until(lock, deadline, [this] { return ended_; })) return false;
  }
  if (thread_.joinable()) thread_.join();
  return true;
}

void TimerThread::run() {
  std::unique_lock lock(mutex_);
  while (!closed_) {
    if (timers_.empty()) {
      changed_.wait(lock);
      continue;
    }
    const auto when = timers_.begin()->first;
    if (std::chrono::steady_clock::now() < when) {
      changed_.wait_until(lock, when);
      continue;
    }
    auto work = std::move(timers_.begin()->second);
    timers_.erase(timers_.begin());
    lock.unlock();
    try {
      work();
    } catch (const std::exception& e) {
      on_exception_(e.what());
    } catch (...) {
      on_exception_("an exception that is not a std::exception");
    }
    work = nullptr;
    lock.lock();
  }
  ended_ = true;
  left_.notify_all();
}

}  // namespace darm::runtime
