#include "actors/runtime/cell.hpp"

namespace darm::runtime {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start, Clock::time_point end) {
  return std::chrono::duration<double>(end - start).count();
}

}  // namespace

bool CellBase::accepts() const {
  const std::lock_guard lock(mutex_);
  return !stopping_;
}

void CellBase::count_drops(std::string_view reason, std::size_t n) const {
  host_->metrics().count("darm_actor_drops_total", static_cast<double>(n),
                         {{"actor", kind_of(name_)}, {"reason", reason}});
}

void CellBase::wake(std::unique_lock<std::mutex>& lock) {
  const bool idle = !scheduled_;
  scheduled_ = true;
  lock.unlock();
  if (idle) host_->schedule(shared_from_this());
}

void CellBase::request_stop() {
  std::unique_lock lock(mutex_);
  if (stopping_) return;
  stopping_ = true;
  wake(lock);
}

void CellBase::start() { host_->schedule(shared_from_this()); }

void CellBase::abandon() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  end();
}

CellBase::Step CellBase::next_step() {
  const std::lock_guard lock(mutex_);
  if (stopping_) return Step::kStop;
  if (start_pending_) {
    start_pending_ = false;
    return Step::kStart;
  }
  if (locked_size() == 0) {
    scheduled_ = false;
    return Step::kIdle;
  }
  locked_pop();
  return Step::kMessage;
}

// Runs `action`; false if it threw, with failure_ set.
bool CellBase::guarded(std::string_view message, const std::function<void()>& action) {
  try {
    action();
    return true;
  } catch (const std::exception& e) {
    failure_ = Failure{name_, std::string(message), e.what()};
  } catch (...) {
    failure_ = Failure{name_, std::string(message), "an exception that is not a std::exception"};
  }
  return false;
}

void CellBase::run_turn() {
  const auto began = host_->executor().thread_time();
  take_turn();
  const std::chrono::duration<double> took = host_->executor().thread_time() - began;
  host_->metrics().count("darm_actor_processor_seconds_total", took.count(), {{"actor", kind_of(name_)}});
}

void CellBase::take_turn() {
  MetricSink& metrics = host_->metrics();
  const std::string_view kind = kind_of(name_);
  const int limit = host_->messages_per_turn();
  for (int handled = 0; handled < limit; ++handled) {
    const Step step = next_step();
    if (step == Step::kIdle) {
      metrics.set("darm_actor_mailbox_depth", 0, {{"actor", kind}});
      return;
    }
    if (step == Step::kStop) return end();
    bool ok = true;
    if (step == Step::kStart) {
      ok = guarded("start", [this] { start_actor(); });
    } else {
      const std::string_view message = popped_name();
      host_->handling(name_, message);
      const auto begin = host_->executor().now();
      ok = guarded(message, [this] { handle_popped(); });
      metrics.observe("darm_actor_handling_seconds", seconds_since(begin, host_->executor().now()), {{"actor", kind}});
      metrics.count("darm_actor_handled_total", 1, {{"actor", kind}, {"message", message}});
    }
    if (!ok) {
      {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
      }
      return end();
    }
  }
  std::size_t depth = 0;
  {
    const std::lock_guard lock(mutex_);
    depth = locked_size();
  }
  metrics.set("darm_actor_mailbox_depth", static_cast<double>(depth), {{"actor", kind}});
  host_->schedule(shared_from_this());  // still `scheduled_`: to the end of the line
}

// The last turn: scheduled_ stays true for ever, so nobody schedules this cell again.
void CellBase::end() {
  std::size_t waiting = 0;
  std::function<void()> destroy_waiting;
  {
    const std::lock_guard lock(mutex_);
    waiting = locked_size();
    destroy_waiting = locked_take_all();
  }
  if (waiting > 0) count_drops("stopped", waiting);
  destroy_waiting();
  destroy_actor();
  host_->retired(*this);
  if (failure_) host_->failed(policy_, *failure_);
}

}  // namespace darm::runtime
