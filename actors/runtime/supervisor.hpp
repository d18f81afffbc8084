// What happens when an actor fails: one readable table, filled by the composition root.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

namespace darm::runtime {

/// A handler (or pool work) threw.
struct Failure {
  std::string actor;    ///< full name, e.g. "session/12"; "pool" or "timer" for work that belongs to no actor
  std::string message;  ///< message type that was being handled, or "start", "work"
  std::string what;     ///< the exception's text
};

enum class FailureAction : std::uint8_t {
  kStopActor,  ///< the actor is destroyed, then `on_failure` runs (it may spawn a new one under the same name)
  kEscalate,   ///< the same, and then the supervisor's `on_escalate` runs: the daemon stops
};

struct SupervisionPolicy {
  FailureAction action = FailureAction::kEscalate;
  std::function<void(const Failure&)> on_failure = {};  ///< on an actor thread, after the actor is gone; may be empty
};

/// The kind of an actor: its name up to the first '/' ("session/12" -> "session"). Policies and metric labels go by
/// kind.
[[nodiscard]] std::string_view kind_of(std::string_view actor_name);

/// Kind -> policy. A kind that is not in the table escalates. Thread-safe.
class Supervisor {
 public:
  /// Sets the policy of a kind. Fill the table before spawning.
  void set(std::string kind, SupervisionPolicy policy);
  /// Runs on the thread of the failure; must not block. Default: nothing (the failure is still counted).
  void on_escalate(std::function<void(const Failure&)> handler);
  /// The policy of an actor by its name.
  [[nodiscard]] SupervisionPolicy policy_of(std::string_view actor_name) const;
  /// Applies `policy` to a failure whose actor is already gone.
  void apply(const SupervisionPolicy& policy, const Failure& failure) const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, SupervisionPolicy, std::less<>> table_;
  std::function<void(const Failure&)> escalate_;
};

}  // namespace darm::runtime
