// Sockets that are no session yet (a TLS handshake, an HTTP request): bounded in number, half of them for one address
// at most, closed when the listener stops.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "actors/session/address_places.hpp"

namespace darm::session {

/// Thread-safe.
class PendingSockets {
  struct State;

 public:
  explicit PendingSockets(std::size_t most);

  /// A place among the pending; given up by its destructor.
  class Place {
   public:
    Place(std::shared_ptr<State> state, std::uint64_t id, AddressPlaces::Place address)
        : state_(std::move(state)), id_(id), address_(std::move(address)) {}
    Place(Place&& other) noexcept = default;
    Place& operator=(Place&& other) noexcept {
      std::swap(state_, other.state_);
      std::swap(id_, other.id_);
      std::swap(address_, other.address_);
      return *this;
    }
    ~Place();

   private:
    std::shared_ptr<State> state_;
    std::uint64_t id_;
    AddressPlaces::Place address_;
  };

  /// `close` is called at most once, by close_all(), from its thread. Nothing: all places are taken, or those that
  /// `address` may have (see peer_of()), or it is closed.
  [[nodiscard]] std::optional<Place> enter(std::function<void()> close, const std::string& address);
  /// Closes all that are here; nobody enters any more.
  void close_all();

 private:
  std::shared_ptr<State> state_;
  AddressPlaces addresses_;
};

}  // namespace darm::session
