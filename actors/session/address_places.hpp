// How many sessions each address has, of all listeners together.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace darm::session {

/// Thread-safe. An address is any text that names one (see peer_of()); the empty one is nobody's and not counted.
class AddressPlaces {
  struct State;

 public:
  explicit AddressPlaces(unsigned most);

  /// One of an address's places; given up by its destructor.
  class Place {
   public:
    Place(std::shared_ptr<State> state, std::string address) : state_(std::move(state)), address_(std::move(address)) {}
    Place(Place&& other) noexcept = default;
    Place& operator=(Place&& other) noexcept {
      std::swap(state_, other.state_);
      std::swap(address_, other.address_);
      return *this;
    }
    ~Place();
    [[nodiscard]] const std::string& address() const { return address_; }

   private:
    std::shared_ptr<State> state_;
    std::string address_;
  };

  /// Nothing: the address has as many as it may.
  [[nodiscard]] std::optional<Place> enter(const std::string& address);
  /// Addresses that have any.
  [[nodiscard]] std::size_t addresses() const;

 private:
  std::shared_ptr<State> state_;
};

}  // namespace darm::session
