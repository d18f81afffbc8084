// Which sessions receive which stream. The tile scheduler writes it, encoders read it.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "actors/runtime/registry.hpp"
#include "actors/session/session_messages.hpp"
#include "actors/types/ids.hpp"

namespace darm {

/// Thread-safe.
class StreamDirectory {
 public:
  using Sessions = runtime::Registry<SessionId, session::Inbox>;
  explicit StreamDirectory(std::shared_ptr<const Sessions> sessions) : sessions_(std::move(sessions)) {}

  /// Replaces the receivers of a stream; none: the stream is forgotten.
  void set(StreamId stream, std::vector<SessionId> receivers) {
    const std::lock_guard lock(mutex_);
    if (receivers.empty()) {
      streams_.erase(stream);
    } else {
      streams_[stream] = std::move(receivers);
    }
  }

  /// The receivers that still live.
  [[nodiscard]] std::vector<std::pair<SessionId, runtime::Ref<session::Inbox>>> receivers(StreamId stream) const {
    const std::lock_guard lock(mutex_);
    std::vector<std::pair<SessionId, runtime::Ref<session::Inbox>>> found;
    const auto entry = streams_.find(stream);
    if (entry == streams_.end()) return found;
    for (const auto id : entry->second) {
      if (auto ref = sessions_->find(id)) found.emplace_back(id, std::move(ref));
    }
    return found;
  }

 private:
  std::shared_ptr<const Sessions> sessions_;
  mutable std::mutex mutex_;
  std::map<StreamId, std::vector<SessionId>> streams_;
};

}  // namespace darm
