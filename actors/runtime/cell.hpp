// Where an actor lives: mailbox, turn and end of life. Used by Ref, Actor and System; rooms do not touch it.
#pragma once

#include <chrono>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "actors/runtime/executor.hpp"
#include "actors/runtime/mailbox.hpp"
#include "actors/runtime/metrics.hpp"
#include "actors/runtime/supervisor.hpp"

namespace darm::runtime {

class CellBase;

/// What a cell needs of its system. Shared by all cells, so that a Ref that outlives the system stays harmless.
class Host {
 public:
  virtual ~Host() = default;
  virtual void schedule(std::shared_ptr<CellBase> cell) = 0;  ///< calls cell->run_turn() soon, on an actor thread
  virtual void retired(const CellBase& cell) = 0;             ///< the actor is destroyed
  virtual void failed(const SupervisionPolicy& policy, const Failure& failure) = 0;
  virtual void handling(const std::string& actor, std::string_view message) = 0;  ///< about to be handled
  virtual int messages_per_turn() const = 0;  ///< after so many the actor goes to the end of the line
  virtual Executor& executor() = 0;
  virtual MetricSink& metrics() = 0;
};

/// Mailbox-independent part: at most one turn at a time, start, stop, failure.
class CellBase : public std::enable_shared_from_this<CellBase> {
 public:
  CellBase(std::shared_ptr<Host> host, std::string name, SupervisionPolicy policy)
      : host_(std::move(host)), name_(std::move(name)), policy_(std::move(policy)) {}
  CellBase(const CellBase&) = delete;
  CellBase& operator=(const CellBase&) = delete;
  virtual ~CellBase() = default;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] Executor& executor() const { return host_->executor(); }
  [[nodiscard]] bool accepts() const;
  /// From any thread, at any time, never refused. The message being handled is finished, waiting ones are dropped.
  void request_stop();
  /// Starts the actor (on_start is its first turn).
  void start();
  /// Instead of start(): destroys the actor on the calling thread.
  void abandon();
  /// One turn: handles some messages, or starts or destroys the actor. Called by the host only.
  void run_turn();

 protected:
  // Called with mutex_ held / on the cell's own turn, as named.
  virtual std::size_t locked_size() const = 0;
  virtual void locked_pop() = 0;                        // moves the oldest message to the place handle_popped() reads
  virtual std::function<void()> locked_take_all() = 0;  // empties the mailbox into a closure that destroys it
  virtual std::string_view popped_name() const = 0;     // on the turn
  virtual void handle_popped() = 0;                     // on the turn
  virtual void start_actor() = 0;                       // on the turn
  virtual void destroy_actor() = 0;                     // on the turn
  void count_drops(std::string_view reason, std::size_t n) const;
  void wake(std::unique_lock<std::mutex>& lock);  // with the lock held; releases it

  std::shared_ptr<Host> host_;
  mutable std::mutex mutex_;
  bool stopping_ = false;  // guarded by mutex_

 private:
  enum class Step { kStart, kMessage, kStop, kIdle };
  Step next_step();
  void take_turn();
  bool guarded(std::string_view message, const std::function<void()>& action);
  void end();

  const std::string name_;
  const SupervisionPolicy policy_;
  bool scheduled_ = true;           // guarded by mutex_; true until start() so that early tells only queue
  bool start_pending_ = true;       // guarded by mutex_
  std::optional<Failure> failure_;  // on the turn
};

/// The cell of actors with this inbox.
template <class Inbox>
class Cell : public CellBase {
 public:
  using Dispatch = std::function<void(Inbox&&)>;

  Cell(std::shared_ptr<Host> host, std::string name, std::size_t capacity, SupervisionPolicy policy)
      : CellBase(std::move(host), std::move(name), std::move(policy)), mailbox_(capacity) {}

  /// The actor itself, set once before start(). `actor` owns it; `begin` is on_start, `dispatch` one message.
  void adopt(std::shared_ptr<void> actor, std::function<void()> begin, Dispatch dispatch) {
    actor_ = std::move(actor);
    begin_ = std::move(begin);
    dispatch_ = std::move(dispatch);
  }

  template <class M>
  bool tell(M message) {
    std::optional<Inbox> displaced;  // destroyed after the lock is released
    std::unique_lock lock(mutex_);
    if (stopping_) {
      lock.unlock();
      count_drops("stopped", 1);
      return false;
    }
    const Delivery delivery = mailbox_.push(std::move(message), displaced);
    if (delivery == Delivery::kRefusedFull) {
      lock.unlock();
      count_drops("full", 1);
      return false;
    }
    wake(lock);
    if (delivery == Delivery::kReplaced) count_drops("replaced", 1);
    if (delivery == Delivery::kMadeRoom) count_drops("oldest", 1);
    return true;
  }

 private:
  std::size_t locked_size() const override { return mailbox_.size(); }
  void locked_pop() override { popped_ = mailbox_.pop(); }
  std::function<void()> locked_take_all() override {
    auto rest = std::make_shared<Mailbox<Inbox>>(1);
    std::swap(*rest, mailbox_);
    return [rest]() mutable { rest.reset(); };
  }
  std::string_view popped_name() const override {
    return std::visit([](const auto& m) { return message_name<std::decay_t<decltype(m)>>(); }, *popped_);
  }
  void handle_popped() override {
    Inbox message = std::move(*popped_);
    popped_.reset();
    dispatch_(std::move(message));
  }
  void start_actor() override {
    if (begin_) begin_();
  }
  void destroy_actor() override {
    popped_.reset();
    begin_ = nullptr;
    dispatch_ = nullptr;
    actor_.reset();
  }

  Mailbox<Inbox> mailbox_;       // guarded by mutex_
  std::optional<Inbox> popped_;  // on the turn
  std::shared_ptr<void> actor_;  // on the turn
  std::function<void()> begin_;
  Dispatch dispatch_;
};

}  // namespace darm::runtime
