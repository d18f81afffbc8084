// Where connections become sessions, whichever listener they came by.
#pragma once

#include <cstddef>
#include <memory>

#include "actors/session/session_actor.hpp"

namespace darm::session {

/// Thread-safe.
class SessionDoor {
 public:
  /// `system` must outlive the door. `mailbox`: of each session.
  SessionDoor(runtime::System& system, std::shared_ptr<SessionSurroundings> surroundings, unsigned max_sessions,
              std::size_t mailbox);

  /// Gives the connection a session actor; one client too many hears SERVER_FULL instead, and is closed.
  void admit(const std::shared_ptr<Connection>& connection);

  [[nodiscard]] unsigned sessions() const { return around_->live->load(); }
  [[nodiscard]] unsigned max_sessions() const { return max_sessions_; }
  [[nodiscard]] runtime::MetricSink& metrics() const { return *around_->metrics; }

 private:
  runtime::System& system_;
  std::shared_ptr<SessionSurroundings> around_;
  unsigned max_sessions_;
  std::size_t mailbox_;
};

}  // namespace darm::session
