#include "actors/session/address_places.hpp"

#include <utility>

namespace darm::session {

struct AddressPlaces::State {
  mutable std::mutex mutex;
  std::map<std::string, unsigned> taken;
  unsigned most = 0;
};

AddressPlaces::AddressPlaces(unsigned most) : state_(std::make_shared<State>()) { state_->most = most; }

AddressPlaces::Place::~Place() {
  if (!state_ || address_.empty()) return;  // moved from, or nobody's
  const std::lock_guard lock(state_->mutex);
  const auto it = state_->taken.find(address_);
  if (it != state_->taken.end() && --it->second == 0) state_->taken.erase(it);
}

std::optional<AddressPlaces::Place> AddressPlaces::enter(const std::string& address) {
  if (!address.empty()) {
    const std::lock_guard lock(state_->mutex);
    auto& taken = state_->taken[address];
    if (taken >= state_->most) {
      if (taken == 0) state_->taken.erase(address);
      return std::nullopt;
    }
    ++taken;
  }
  return std::make_optional<Place>(state_, address);
}

std::size_t AddressPlaces::addresses() const {
  const std::lock_guard lock(state_->mutex);
  return state_->taken.size();
}

}  // namespace darm::session
