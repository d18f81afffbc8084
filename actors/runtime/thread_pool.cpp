#include "actors/runtime/thread_pool.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <utility>

namespace darm::runtime {

unsigned usable_cores() {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) == 0 && CPU_COUNT(&set) > 0) return static_cast<unsigned>(CPU_COUNT(&set));
  return std::max(1u, std::thread::hardware_concurrency());
}

ThreadPool::ThreadPool(const std::string& name, unsigned threads, int niceness,
                       std::function<void(const std::string&)> on_exception)
    : on_exception_(std::move(on_exception)) {
  const unsigned count = threads == 0 ? 1 : threads;
  running_threads_ = count;
  threads_.reserve(count);
  for (unsigned i = 0; i < count; ++i) {
    threads_.emplace_back([this, niceness] { run(niceness); });
    pthread_setname_np(threads_.back().native_handle(), (name + "/" + std::to_string(i)).substr(0, 15).c_str());
  }
}

ThreadPool::~ThreadPool() {
  close();
  for (auto& thread : threads_)
    if (thread.joinable()) thread.join();
}

void ThreadPool::post(Priority priority, Work work) {
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    queues_[static_cast<std::size_t>(priority)].push_back(std::move(work));
  }
  has_work_.notify_one();
}

void ThreadPool::close() {
  std::array<std::deque<Work>, 3> dropped;  // destroyed after the lock is released
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    std::swap(dropped, queues_);
  }
  has_work_.notify_all();
}

bool ThreadPool::join_until(std::chrono::steady_clock::time_point deadline) {
  {
    std::unique_lock lock(mutex_);
    if (!thread_left_.wait_until(lock, deadline, [this] { return running_threads_ == 0; })) return false;
  }
  for (auto& thread : threads_)
    if (thread.joinable()) thread.join();
  return true;
}

unsigned ThreadPool::busy() const {
  const std::lock_guard lock(mutex_);
  return busy_;
}

// The next piece of work, highest priority first; false when the pool is closed.
bool ThreadPool::take(Work& work) {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (closed_) return false;
    for (auto& queue : queues_) {
      if (queue.empty()) continue;
      work = std::move(queue.front());
      queue.pop_front();
      ++busy_;
      return true;
    }
    has_work_.wait(lock);
  }
}

void ThreadPool::run(int niceness) {
  // On Linux niceness is per thread. Failure (no such right) only costs politeness.
  if (niceness > 0) (void)setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), niceness);
  Work work;
  while (take(work)) {
    try {
      work();
    } catch (const std::exception& e) {
      on_exception_(e.what());
    } catch (...) {
      on_exception_("an exception that is not a std::exception");
    }
    work = nullptr;  // what it owns goes before the thread counts as free
    const std::lock_guard lock(mutex_);
    --busy_;
  }
  const std::lock_guard lock(mutex_);
  --running_threads_;
  thread_left_.notify_all();
}

}  // namespace darm::runtime
