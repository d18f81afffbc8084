#include "actors/runtime/threaded_system.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <ctime>
#include <map>
#include <mutex>
#include <utility>

#include "actors/runtime/thread_pool.hpp"
#include "actors/runtime/timer_thread.hpp"

namespace darm::runtime {
namespace {

constexpr int kMessagesPerTurn = 16;

}  // namespace

class ThreadedSystem::Core final : public Host, public Executor {
 public:
  Core(const ThreadedOptions& options, Supervisor& supervisor)
      : sink_(options.metrics != nullptr ? options.metrics : &null_metrics()),
        supervisor_(&supervisor),
        timer_([this](const std::string& what) { work_failed("timer", what); }),
        turns_("actors", options.actor_threads, 0, [this](const std::string& what) { work_failed("actors", what); }),
        pool_("pool", options.workers == 0 ? usable_cores() : options.workers, options.worker_nice,
              [this](const std::string& what) { work_failed("pool", what); }) {}

  void schedule(std::shared_ptr<CellBase> cell) override {
    turns_.post(Priority::kNormal, [cell = std::move(cell)] { cell->run_turn(); });
  }
  void retired(const CellBase& cell) override {
    const std::lock_guard lock(mutex_);
    living_.erase(&cell);
    count_living(cell, -1);
    if (living_.empty()) nobody_left_.notify_all();
  }
  void failed(const SupervisionPolicy& policy, const Failure& failure) override {
    metrics().count("darm_actor_failures_total", 1, {{"actor", kind_of(failure.actor)}});
    supervisor_->apply(policy, failure);
  }
  void handling(const std::string&, std::string_view) override {}
  int messages_per_turn() const override { return kMessagesPerTurn; }
  Executor& executor() override { return *this; }
  MetricSink& metrics() override { return *sink_.load(); }

  void post(Priority priority, std::function<void()> work) override { pool_.post(priority, std::move(work)); }
  void after(std::chrono::microseconds delay, std::function<void()> work) override {
    timer_.at(now() + std::max(delay, std::chrono::microseconds(0)), std::move(work));
  }
  std::chrono::steady_clock::time_point now() const override { return std::chrono::steady_clock::now(); }
  std::chrono::microseconds thread_time() const override {
    timespec spent{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &spent);  // cannot fail for the calling thread
    return std::chrono::microseconds(std::int64_t{spent.tv_sec} * 1'000'000 + spent.tv_nsec / 1000);
  }
  unsigned workers() const override { return pool_.threads(); }

  bool admit(const std::shared_ptr<CellBase>& cell) {
    const std::lock_guard lock(mutex_);
    if (closing_) return false;
    living_.emplace(cell.get(), cell);
    count_living(*cell, 1);
    return true;
  }

  std::vector<std::string> shutdown(std::chrono::steady_clock::time_point deadline) {
    std::map<const CellBase*, std::shared_ptr<CellBase>> living;
    {
      const std::lock_guard lock(mutex_);
      closing_ = true;
      living = living_;
    }
    timer_.close();
    pool_.close();
    for (const auto& [key, cell] : living) cell->request_stop();
    living.clear();

    std::vector<std::string> late;
    {
      std::unique_lock lock(mutex_);
      nobody_left_.wait_until(lock, deadline, [this] { return living_.empty(); });
      for (const auto& [key, cell] : living_) late.push_back(cell->name());
    }
    if (!pool_.join_until(deadline)) late.push_back("pool (" + std::to_string(pool_.busy()) + " slices running)");
    if (!timer_.join_until(deadline)) late.emplace_back("timer");
    if (late.empty()) {
      turns_.close();
      if (!turns_.join_until(deadline)) late.emplace_back("actor threads");
    }
    return late;
  }

  /// From here on Refs that outlive the system count their drops nowhere.
  void forget_sink() { sink_ = &null_metrics(); }

 private:
  // With mutex_ held.
  void count_living(const CellBase& cell, int change) {
    const auto kind = kind_of(cell.name());
    const int now = living_by_kind_[std::string(kind)] += change;
    metrics().set("darm_actors", now, {{"actor", kind}});
  }
  void work_failed(const char* owner, const std::string& what) {
    failed(supervisor_->policy_of(owner), Failure{owner, "work", what});
  }

  std::atomic<MetricSink*> sink_;  // Refs may outlive the system, and it the sink
  Supervisor* supervisor_;
  std::mutex mutex_;
  std::condition_variable nobody_left_;
  bool closing_ = false;
  std::map<const CellBase*, std::shared_ptr<CellBase>> living_;
  std::map<std::string, int> living_by_kind_;
  // Last, so that no thread outlives what it uses; `timer_` and `pool_` may schedule turns, so they are made around
  // them.
  TimerThread timer_;
  ThreadPool turns_;
  ThreadPool pool_;
};

ThreadedSystem::ThreadedSystem(ThreadedOptions options) : core_(std::make_shared<Core>(options, supervisor_)) {}

ThreadedSystem::~ThreadedSystem() {
  (void)shutdown(std::chrono::hours(24 * 365));
  core_->forget_sink();
}

std::vector<std::string> ThreadedSystem::shutdown(std::chrono::milliseconds deadline) {
  return core_->shutdown(std::chrono::steady_clock::now() + deadline);
}

std::shared_ptr<Host> ThreadedSystem::host() { return core_; }

bool ThreadedSystem::admit(const std::shared_ptr<CellBase>& cell) { return core_->admit(cell); }

}  // namespace darm::runtime
