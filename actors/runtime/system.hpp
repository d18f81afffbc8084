// Spawns and stops actors. ThreadedSystem (the daemon) and DeterministicSystem (tests) derive from it, so that whoever
// takes a System& runs under both.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "actors/runtime/actor.hpp"

namespace darm::runtime {

class System {
 public:
  System(const System&) = delete;
  System& operator=(const System&) = delete;
  virtual ~System() = default;

  /// Makes an actor `A(Context, args...)` on the calling thread; its turns run on the system's threads. Names read
  /// "kind" or "kind/instance"; the supervisor's table and the metrics go by kind. Thread-safe.
  /// An empty Ref once shutdown has begun. Exceptions of A's constructor reach the caller.
  template <class A, class... Args>
  Ref<typename A::Inbox> spawn(std::string name, std::size_t mailbox_capacity, Args&&... args) {
    SupervisionPolicy policy = supervisor_.policy_of(name);
    return spawn_supervised<A>(std::move(policy), std::move(name), mailbox_capacity, std::forward<Args>(args)...);
  }

  /// The same with a policy of its own instead of the table's.
  template <class A, class... Args>
  Ref<typename A::Inbox> spawn_supervised(SupervisionPolicy policy, std::string name, std::size_t mailbox_capacity,
                                          Args&&... args) {
    using Inbox = typename A::Inbox;
    static_assert(HandlersOf<A, Inbox>::kComplete);
    auto cell = std::make_shared<Cell<Inbox>>(host(), std::move(name), mailbox_capacity, std::move(policy));
    Ref<Inbox> ref(cell);
    auto actor = std::make_shared<A>(Context<Inbox>(ref, executor(), *this), std::forward<Args>(args)...);
    A* raw = actor.get();
    cell->adopt(
        std::move(actor), [raw] { raw->on_start(); },
        [raw](Inbox&& inbox) {
          std::visit([raw]<class M>(M&& message) { raw->on(std::forward<M>(message)); }, std::move(inbox));
        });
    if (!admit(cell)) {
      cell->abandon();
      return {};
    }
    cell->start();
    return ref;
  }

  /// The actor finishes its current message and is then destroyed on its own turn; later messages are refused.
  template <class Inbox>
  void stop(const Ref<Inbox>& ref) {
    if (ref.cell_) ref.cell_->request_stop();
  }

  [[nodiscard]] Supervisor& supervisor() { return supervisor_; }
  [[nodiscard]] Executor& executor() { return host()->executor(); }
  [[nodiscard]] MetricSink& metrics() { return host()->metrics(); }

 protected:
  System() = default;
  [[nodiscard]] virtual std::shared_ptr<Host> host() = 0;
  /// Enters the cell into the list of the living; false once shutdown has begun.
  virtual bool admit(const std::shared_ptr<CellBase>& cell) = 0;

  Supervisor supervisor_;
};

}  // namespace darm::runtime
