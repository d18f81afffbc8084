#include "daemon/freed_memory.hpp"

#include <malloc.h>

#include <chrono>

namespace darm {
namespace {

constexpr int kKeptBlock = 4 << 20;       // bytes; larger ones, as a coder has, go back at once
constexpr int kKeptAtTheEnd = 32 << 20;   // of each heap
constexpr std::chrono::seconds kWait{3};  // more clients may go with the first

}  // namespace

void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, kKeptBlock);
  mallopt(M_TRIM_THRESHOLD, kKeptAtTheEnd);
}

void FreedMemory::give_back_soon(runtime::Executor& executor) {
  if (due_->exchange(true)) return;
  executor.after(kWait, [&executor, due = due_] {
    executor.post(runtime::Priority::kNormal, [due] {
      due->store(false);
      malloc_trim(0);
    });
  });
}

}  // namespace darm
