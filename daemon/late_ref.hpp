// A Ref that is known only after its user has been spawned: breaks the cycle between scheduler and renderer.
#pragma once

#include <mutex>
#include <utility>

#include "actors/runtime/actor.hpp"

namespace darm {

/// Thread-safe. Empty until set.
template <class Inbox>
class LateRef {
 public:
  void set(runtime::Ref<Inbox> ref) {
    const std::lock_guard lock(mutex_);
    ref_ = std::move(ref);
  }
  [[nodiscard]] runtime::Ref<Inbox> get() const {
    const std::lock_guard lock(mutex_);
    return ref_;
  }

 private:
  mutable std::mutex mutex_;
  runtime::Ref<Inbox> ref_;
};

}  // namespace darm
