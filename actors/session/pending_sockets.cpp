#include "actors/session/pending_sockets.hpp"

#include <algorithm>
#include <utility>

namespace darm::session {
namespace {
constexpr std::size_t kMostPerAddress = 1u << 20;
}  // namespace

struct PendingSockets::State {
  std::mutex mutex;
  std::map<std::uint64_t, std::function<void()>> closers;
  std::uint64_t next = 1;
  std::size_t most = 0;
  bool closed = false;
};

// With half of the places, one address cannot keep the others out.
PendingSockets::PendingSockets(std::size_t most)
    : state_(std::make_shared<State>()),
      addresses_(static_cast<unsigned>(std::clamp<std::size_t>(most / 2, 1, kMostPerAddress))) {
  state_->most = most;
}

PendingSockets::Place::~Place() {
  if (!state_) return;  // moved from
  const std::lock_guard lock(state_->mutex);
  state_->closers.erase(id_);
}

std::optional<PendingSockets::Place> PendingSockets::enter(std::function<void()> close, const std::string& address) {
  auto among_its_own = addresses_.enter(address);
  if (!among_its_own) return std::nullopt;
  const std::lock_guard lock(state_->mutex);
  if (state_->closed || state_->closers.size() >= state_->most) return std::nullopt;
  const auto id = state_->next++;
  state_->closers.emplace(id, std::move(close));
  return std::make_optional<Place>(state_, id, std::move(*among_its_own));
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
