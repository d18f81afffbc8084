// Run a loop over a fixed number of threads. For load-time work only; rooms that serve clients use the daemon's pool.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace darm::atlas {

/// Calls body(i) for every i in [0, count), in any order, on up to `threads` threads (the caller is one of them).
/// Results must go to slots of their own, so that they do not depend on the thread count. The first exception is
/// rethrown.
template <class Body>
void parallel_for(std::size_t count, unsigned threads, const Body& body) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr first;
  std::mutex guard;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) body(i);
    } catch (...) {
      const std::lock_guard lock(guard);
      if (!first) first = std::current_exception();
      next = count;
    }
  };
  const std::size_t wanted = std::min<std::size_t>(std::max(threads, 1u), std::max<std::size_t>(count, 1));
  {
    std::vector<std::jthread> crew;
    for (std::size_t i = 1; i < wanted; ++i) crew.emplace_back(work);
    work();
  }
  if (first) std::rethrow_exception(first);
}

}  // namespace darm::atlas
