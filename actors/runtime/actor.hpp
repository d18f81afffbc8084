// Ref, Context and Actor: what a room writes its actor with. Start here:
//   class EncoderActor : public runtime::Actor<encoder::Inbox> {
//    public: explicit EncoderActor(runtime::Context<encoder::Inbox> context, ...) : Actor(std::move(context)) {}
//            void on(ComposeFrame&& message);  // one public handler per alternative of the inbox
//   };
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "actors/runtime/cell.hpp"
#include "actors/runtime/executor.hpp"

namespace darm::runtime {

class System;

template <class M, class Inbox>
inline constexpr bool kIsAlternative = false;
template <class M, class... Ms>
inline constexpr bool kIsAlternative<M, std::variant<Ms...>> = (std::is_same_v<M, Ms> || ...);

/// Handle to an actor's mailbox. Copyable, thread-safe, never blocks; may outlive the actor and the system.
template <class Inbox>
class Ref {
 public:
  Ref() = default;

  /// Puts `message` into the mailbox by its overflow policy. False: refused (full, stopped, or an empty Ref).
  template <class M>
  bool tell(M message) const {
    static_assert(kIsAlternative<M, Inbox>, "tell: this message type is not an alternative of the actor's inbox");
    return cell_ && cell_->tell(std::move(message));
  }
  /// True while the actor takes messages (a moment later it may not).
  explicit operator bool() const { return cell_ && cell_->accepts(); }
  /// The actor's name; empty for an empty Ref.
  [[nodiscard]] std::string name() const { return cell_ ? cell_->name() : std::string(); }
  bool operator==(const Ref&) const = default;

 private:
  friend class System;
  template <class>
  friend class Context;
  explicit Ref(std::shared_ptr<Cell<Inbox>> cell) : cell_(std::move(cell)) {}
  std::shared_ptr<Cell<Inbox>> cell_;
};

/// What spawn() hands to an actor's constructor as its first argument.
template <class Inbox>
class Context {
 public:
  [[nodiscard]] const Ref<Inbox>& self() const { return self_; }
  [[nodiscard]] Executor& executor() const { return *executor_; }
  [[nodiscard]] const std::string& name() const { return self_.cell_->name(); }
  [[nodiscard]] System& system() const { return *system_; }

 private:
  friend class System;
  Context(Ref<Inbox> self, Executor& executor, System& system)
      : self_(std::move(self)), executor_(&executor), system_(&system) {}
  Ref<Inbox> self_;
  Executor* executor_;
  System* system_;
};

/// Base of all actors. One thread at a time runs handlers; handlers never block. A handler that throws is a failure:
/// the actor is destroyed and the supervisor's table decides what follows.
template <class InboxT>
class Actor {
 public:
  using Inbox = InboxT;
  Actor(const Actor&) = delete;
  Actor& operator=(const Actor&) = delete;
  virtual ~Actor() = default;
  /// First thing, on the actor's own turn, before any message.
  virtual void on_start() {}

 protected:
  explicit Actor(Context<Inbox> context) : context_(std::move(context)) {}
  [[nodiscard]] Ref<Inbox> self() const { return context_.self(); }
  [[nodiscard]] Executor& executor() const { return context_.executor(); }
  [[nodiscard]] const std::string& name() const { return context_.name(); }
  /// For spawning and stopping other actors. Valid as long as the actor is.
  [[nodiscard]] System& system() const { return context_.system(); }
  /// The executor's clock in microseconds.
  [[nodiscard]] std::int64_t now_us() const {
    return std::chrono::duration_cast<std::chrono::microseconds>(executor().now().time_since_epoch()).count();
  }

 private:
  Context<Inbox> context_;
};

/// Instantiated per actor and message type, so that the compiler's note names both.
template <class A, class M>
struct HandlerOf {
  static constexpr bool kExists = requires(A& actor, M&& message) { actor.on(std::move(message)); };
  static_assert(kExists,
                "actor A lacks a public handler `void on(M&&)` for an alternative M of its inbox (see the note)");
};

template <class A, class Inbox>
struct HandlersOf;
template <class A, class... Ms>
struct HandlersOf<A, std::variant<Ms...>> {
  static constexpr bool kComplete = (HandlerOf<A, Ms>::kExists && ...);
};

}  // namespace darm::runtime
