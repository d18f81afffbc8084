// Sockets that are no session yet (a TLS handshake, an HTTP request): bounded in number, closed when the listener
// stops.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

namespace darm::session {

/// Thread-safe.
class PendingSockets {
  struct State;

 public:
  explicit PendingSockets(std::size_t most);

  /// A place among the pending; given up by its destructor.
  class Place {
   public:
    Place(std::shared_ptr<State> state, std::uint64_t id) : state_(std::move(state)), id_(id) {}
    Place(Place&& other) noexcept = default;
    Place& operator=(Place&& other) noexcept {
      std::swap(state_, other.state_);
      std::swap(id_, other.id_);
      return *this;
    }
    ~Place();

   private:
    std::shared_ptr<State> state_;
    std::uint64_t id_;
  };

  /// `close` is called at most once, by close_all(), from its thread. Nothing: all places are taken, or it is closed.
  [[nodiscard]] std::optional<Place> enter(std::function<void()> close);
  /// Closes all that are here; nobody enters any more.
  void close_all();

 private:
  std::shared_ptr<State> state_;
};

}  // namespace darm::session
