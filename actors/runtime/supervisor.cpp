#include "actors/runtime/supervisor.hpp"

#include <utility>

namespace darm::runtime {

std::string_view kind_of(std::string_view actor_name) { return actor_name.substr(0, actor_name.find('/')); }

void Supervisor::set(std::string kind, SupervisionPolicy policy) {
  const std::lock_guard lock(mutex_);
  table_.insert_or_assign(std::move(kind), std::move(policy));
}

void Supervisor::on_escalate(std::function<void(const Failure&)> handler) {
  const std::lock_guard lock(mutex_);
  escalate_ = std::move(handler);
}

SupervisionPolicy Supervisor::policy_of(std::string_view actor_name) const {
  const std::lock_guard lock(mutex_);
  const auto it = table_.find(kind_of(actor_name));
  return it == table_.end() ? SupervisionPolicy{} : it->second;
}

void Supervisor::apply(const SupervisionPolicy& policy, const Failure& failure) const {
  if (policy.on_failure) policy.on_failure(failure);
  if (policy.action != FailureAction::kEscalate) return;
  std::function<void(const Failure&)> escalate;
  {
    const std::lock_guard lock(mutex_);
    escalate = escalate_;
  }
  if (escalate) escalate(failure);
}

}  // namespace darm::runtime
