// Where connections become sessions, whichever listener they came by.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "actors/session/session_actor.hpp"

namespace darm::session {

/// Thread-safe.
class SessionDoor {
 public:
  /// `system` must outlive the door. `mailbox`: of each session.
  SessionDoor(runtime::System& system, std::shared_ptr<SessionSurroundings> surroundings, unsigned max_sessions,
              std::size_t mailbox);

  /// Gives the connection, which comes from `peer` (see peer_of()), a session actor. One client too many, of all, of
  /// this address or for the memory there is, hears SERVER_FULL and why instead, and is closed.
  void admit(const std::shared_ptr<Connection>& connection, const std::string& peer);

  [[nodiscard]] unsigned sessions() const { return around_->live->load(); }
  [[nodiscard]] unsigned max_sessions() const { return max_sessions_; }
  [[nodiscard]] runtime::MetricSink& metrics() const { return *around_->metrics; }

 private:
  void refuse(Connection& connection, std::string_view what, const char* text) const;

  runtime::System& system_;
  std::shared_ptr<SessionSurroundings> around_;
  unsigned max_sessions_;
  std::size_t mailbox_;
};

}  // namespace darm::session
