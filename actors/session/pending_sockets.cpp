#include "actors/session/pending_sockets.hpp"

#include <utility>

namespace darm::session {

struct PendingSockets::State {
  std::mutex mutex;
  std::map<std::uint64_t, std::function<void()>> closers;
  std::uint64_t next = 1;
  std::size_t most = 0;
  bool closed = false;
};

PendingSockets::PendingSockets(std::size_t most) : state_(std::make_shared<State>()) { state_->most = most; }

PendingSockets::Place::~Place() {
  if (!state_) return;  // moved from
  const std::lock_guard lock(state_->mutex);
  state_->closers.erase(id_);
}

std::optional<PendingSockets::Place> PendingSockets::enter(std::function<void()> close) {
  const std::lock_guard lock(state_->mutex);
  if (state_->closed || state_->closers.size() >= state_->most) return std::nullopt;
  const auto id = state_->next++;
  state_->closers.emplace(id, std::move(close));
  return std::make_optional<Place>(state_, id);
}

void PendingSockets::close_all() {
  std::map<std::uint64_t, std::function<void()>> closers;
  {
    const std::lock_guard lock(state_->mutex);
    state_->closed = true;
    closers = std::exchange(state_->closers, {});
  }
  for (const auto& [id, close] : closers) close();
}

}  // namespace darm::session
