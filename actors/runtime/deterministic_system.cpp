#include "actors/runtime/deterministic_system.hpp"

#include <algorithm>
#include <array>
#include <deque>
#include <functional>
#include <map>
#include <stdexcept>
#include <utility>

namespace darm::runtime {

class DeterministicSystem::Core final : public Host, public Executor {
 public:
  Core(unsigned workers, MetricSink* sink, Supervisor& supervisor)
      : workers_(workers == 0 ? 1 : workers),
        sink_(sink != nullptr ? sink : &null_metrics()),
        supervisor_(&supervisor) {}

  void schedule(std::shared_ptr<CellBase> cell) override { turns_.push_back(std::move(cell)); }
  void retired(const CellBase& cell) override { living_.erase(&cell); }
  void failed(const SupervisionPolicy& policy, const Failure& failure) override {
    if (supervisor_ != nullptr) supervisor_->apply(policy, failure);
    failures_.push_back(failure);
  }
  void handling(const std::string& actor, std::string_view message) override {
    log_.push_back(Handled{actor, std::string(message)});
  }
  int messages_per_turn() const override { return 1; }
  Executor& executor() override { return *this; }
  MetricSink& metrics() override { return *sink_; }

  void post(Priority priority, std::function<void()> work) override {
    work_[static_cast<std::size_t>(priority)].push_back(std::move(work));
  }
  void after(std::chrono::microseconds delay, std::function<void()> work) override {
    timers_.emplace(now_ + std::max(delay, std::chrono::microseconds(0)), std::move(work));
  }
  std::chrono::steady_clock::time_point now() const override { return now_; }
  std::chrono::microseconds thread_time() const override {
    return std::chrono::duration_cast<std::chrono::microseconds>(now_.time_since_epoch());
  }
  unsigned workers() const override { return workers_; }

  bool step() {
    if (!turns_.empty()) {
      const auto cell = std::move(turns_.front());
      turns_.pop_front();
      cell->run_turn();
      return true;
    }
    if (fire_due_timer()) return true;
    for (auto& queue : work_) {
      if (queue.empty()) continue;
      const auto work = std::move(queue.front());
      queue.pop_front();
      run("pool", work);
      return true;
    }
    return false;
  }

  // Ends everything: queued work is dropped, every actor destroyed on a turn of its own.
  void close() {
    closed_ = true;
    drop_work();
    for (const auto& [key, cell] : std::map(living_)) cell->request_stop();
    while (!turns_.empty()) step();
    drop_work();
    supervisor_ = nullptr;
    sink_ = &null_metrics();
  }

  std::chrono::steady_clock::time_point now_{std::chrono::hours(1)};
  std::multimap<std::chrono::steady_clock::time_point, std::function<void()>> timers_;
  std::map<const CellBase*, std::shared_ptr<CellBase>> living_;
  std::vector<Handled> log_;
  std::vector<Failure> failures_;
  bool closed_ = false;

 private:
  bool fire_due_timer() {
    const auto first = timers_.begin();
    if (first == timers_.end() || first->first > now_) return false;
    const auto work = std::move(first->second);
    timers_.erase(first);
    run("timer", work);
    return true;
  }

  void run(const char* owner, const std::function<void()>& work) {
    try {
      work();
    } catch (const std::exception& e) {
      failed(supervisor_->policy_of(owner), Failure{owner, "work", e.what()});
    } catch (...) {
      failed(supervisor_->policy_of(owner), Failure{owner, "work", "an exception that is not a std::exception"});
    }
  }

  void drop_work() {
    timers_.clear();
    for (auto& queue : work_) queue.clear();
  }

  unsigned workers_;
  MetricSink* sink_;
  Supervisor* supervisor_;
  std::deque<std::shared_ptr<CellBase>> turns_;
  std::array<std::deque<std::function<void()>>, 3> work_;
};

DeterministicSystem::DeterministicSystem(unsigned workers, MetricSink* metrics)
    : core_(std::make_shared<Core>(workers, metrics, supervisor_)) {}

DeterministicSystem::~DeterministicSystem() { core_->close(); }

std::shared_ptr<Host> DeterministicSystem::host() { return core_; }

bool DeterministicSystem::admit(const std::shared_ptr<CellBase>& cell) {
  if (core_->closed_) return false;
  core_->living_.emplace(cell.get(), cell);
  return true;
}

std::size_t DeterministicSystem::run_until_idle(std::size_t max_steps) {
  std::size_t steps = 0;
  while (core_->step())
    if (++steps > max_steps)
      throw std::runtime_error("run_until_idle: still busy after " + std::to_string(steps) + " steps");
  return steps;
}

void DeterministicSystem::advance(std::chrono::microseconds duration) {
  const auto end = core_->now_ + duration;
  run_until_idle();
  while (!core_->timers_.empty() && core_->timers_.begin()->first <= end) {
    core_->now_ = std::max(core_->now_, core_->timers_.begin()->first);
    run_until_idle();
  }
  core_->now_ = end;
}

const std::vector<DeterministicSystem::Handled>& DeterministicSystem::messages_log() const { return core_->log_; }
void DeterministicSystem::clear_log() { core_->log_.clear(); }
const std::vector<Failure>& DeterministicSystem::failures() const { return core_->failures_; }
std::size_t DeterministicSystem::pending_timers() const { return core_->timers_.size(); }

}  // namespace darm::runtime
