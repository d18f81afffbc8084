// id -> Ref, for look-up and broadcast. Thread-safe.
#pragma once

#include <cstddef>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "actors/runtime/actor.hpp"

namespace darm::runtime {

template <class Id, class Inbox>
class Registry {
 public:
  /// Adds or replaces.
  void add(Id id, Ref<Inbox> ref) {
    const std::lock_guard lock(mutex_);
    refs_.insert_or_assign(id, std::move(ref));
  }
  void remove(Id id) {
    const std::lock_guard lock(mutex_);
    refs_.erase(id);
  }
  /// An empty Ref if there is none; telling it returns false.
  [[nodiscard]] Ref<Inbox> find(Id id) const {
    const std::lock_guard lock(mutex_);
    const auto it = refs_.find(id);
    return it == refs_.end() ? Ref<Inbox>() : it->second;
  }
  [[nodiscard]] std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return refs_.size();
  }
  /// Calls `visit(id, ref)` for a snapshot, without the lock: the visitor may add and remove. In order of id.
  template <class F>
  void for_each(F&& visit) const {
    std::vector<std::pair<Id, Ref<Inbox>>> snapshot;
    {
      const std::lock_guard lock(mutex_);
      snapshot.assign(refs_.begin(), refs_.end());
    }
    for (const auto& [id, ref] : snapshot) visit(id, ref);
  }

 private:
  mutable std::mutex mutex_;
  std::map<Id, Ref<Inbox>> refs_;
};

}  // namespace darm::runtime
