// What the allocator does with memory that has been freed.
#pragma once

#include <atomic>
#include <memory>

#include "actors/runtime/executor.hpp"

namespace darm {

/// Keeps blocks of some hundred kilobytes in the process, as each look, batch of light and picture allocates and frees
/// them within milliseconds: given back to the kernel each time, they cost more in page faults than in use (a sixth of
/// the daemon's time with 100 clients). Call once, at the start.
void keep_freed_memory();

/// Gives back what is free a while after clients have gone, when what they took is free in pieces. Thread-safe.
class FreedMemory {
 public:
  /// Some seconds from now, once however often it is called meanwhile. `executor` must outlive its own work.
  void give_back_soon(runtime::Executor& executor);

 private:
  std::shared_ptr<std::atomic<bool>> due_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace darm
