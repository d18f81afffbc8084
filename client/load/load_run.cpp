#include "client/load/load_run.hpp"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <memory>
#include <utility>

#include "client/load/load_connection.hpp"
#include "client/load/picture_worker.hpp"
#include "client/load/process_usage.hpp"

namespace darm::client::load {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::milliseconds kTick{5};
constexpr std::int64_t kSecond = 1'000'000;
constexpr double kLastJoin = 2.0;  // seconds before the end, so that everybody has been welcomed by then

double seconds(std::int64_t us) { return static_cast<double>(us) / 1e6; }

// Smallest, largest and last of what is looked at once a second.
void note(std::optional<StartMaxEnd>& range, std::uint64_t value) {
  if (!range) range = StartMaxEnd{value, value, value};
  range->max = std::max(range->max, value);
  range->end = value;
}

class Run {
 public:
  explicit Run(LoadPlan plan)
      : plan_(std::move(plan)),
        route_(plan_.walkthrough, plan_.places, plan_.crowd.clients),
        timer_(io_),
        signals_(io_) {}

  Result<LoadReport> execute();

 private:
  // A client, and how much of its figures the timeline has seen.
  struct Slot {
    std::shared_ptr<LoadConnection> connection;
    PictureSink* pictures = nullptr;
    std::size_t waits_seen = 0;
    std::uint64_t frames_seen = 0, no_changes_seen = 0;
    bool recorded = false;
  };
  enum class Phase : std::uint8_t { kJoining, kCounting, kSettling, kDone };

  Result<void> resolve();
  Result<void> make_crowd();
  void turn();
  void advance(std::int64_t now);
  void connect_due(std::int64_t now);
  void connect(Slot& slot, const ClientPlan& who, std::int64_t now);
  [[nodiscard]] bool all_ready() const;
  void begin_counting(std::int64_t now);
  void end_counting(std::int64_t now);
  void vanish_due(std::int64_t now);
  void stall_due(std::int64_t now);
  void churn_due(std::int64_t now);
  void record(Slot& slot, std::int64_t now);
  void look_at_server();
  void note_moment(std::int64_t now);
  void finish_report();

  LoadPlan plan_;
  Route route_;
  asio::io_context io_{1};
  asio::steady_timer timer_;
  asio::signal_set signals_;
  tcp::endpoint server_;
  Commons commons_;
  std::unique_ptr<PictureWorker> pictures_;
  std::vector<ClientPlan> crowd_;
  std::vector<Slot> slots_;
  std::vector<ClientRecord> records_;
  LoadReport report_;
  Phase phase_ = Phase::kJoining;
  bool interrupted_ = false;
  std::int64_t began_ = 0, counting_since_ = 0, settling_since_ = 0, next_look_ = 0;
  bool stalled_ = false;
  std::uint64_t drawn_before_ = 0;
  std::uint64_t churned_ = 0;
  std::uint32_t next_leaver_ = 0;
  double harness_cpu_ = 0, harness_cpu_before_ = 0, harness_cpu_moment_ = 0;
  std::optional<double> server_cpu_, server_cpu_before_, server_cpu_moment_;
};

Result<void> Run::resolve() {
  error_code ec;
  tcp::resolver resolver(io_);
  const auto found = resolver.resolve(plan_.host, std::to_string(plan_.port), ec);
  if (ec || found.empty()) return fail(plan_.host + ": " + (ec ? ec.message() : "no address"));
  server_ = found.begin()->endpoint();
  return {};
}

Result<void> Run::make_crowd() {
  plan_.crowd.places = route_.places();
  auto crowd = plan_crowd(plan_.crowd);
  if (!crowd) return std::unexpected(crowd.error());
  crowd_ = std::move(*crowd);
  slots_.resize(crowd_.size());
  if (plan_.crowd.draw + plan_.crowd.decode == 0) return {};
  auto worker = PictureWorker::create(plan_.crowd.draw > 0, plan_.draw_height);
  if (!worker) return std::unexpected(worker.error());
  pictures_ = std::move(*worker);
  for (std::size_t i = 0; i < crowd_.size(); ++i)
    if (crowd_[i].decodes) slots_[i].pictures = pictures_->add(crowd_[i].draws);
  return {};
}

Result<LoadReport> Run::execute() {
  if (auto ok = resolve(); !ok) return std::unexpected(ok.error());
  if (auto ok = make_crowd(); !ok) return std::unexpected(ok.error());
  if (plan_.server_pid > 0 && !usage_of(plan_.server_pid))
    return fail("--server-pid " + std::to_string(plan_.server_pid) + ": there is no such process");
  error_code ignored;
  signals_.add(SIGINT, ignored);
  signals_.add(SIGTERM, ignored);
  signals_.async_wait([this](error_code ec, int) { interrupted_ = interrupted_ || !ec; });
  began_ = next_look_ = clock_us();
  plan_.machine.epoch_us = began_;
  look_at_server();
  turn();
  io_.run();
  finish_report();
  return std::move(report_);
}

void Run::turn() {
  const auto now = clock_us();
  for (auto& slot : slots_)
    if (slot.connection) slot.connection->tick(now);
  advance(now);
  if (phase_ == Phase::kDone) {
    error_code ignored;
    signals_.cancel(ignored);
    return;
  }
  timer_.expires_after(kTick);
  timer_.async_wait([this](error_code ec) {
    if (!ec) turn();
  });
}

void Run::advance(std::int64_t now) {
  if (phase_ == Phase::kJoining) {
    connect_due(now);
    if (all_ready() || interrupted_ || seconds(now - began_) >= plan_.warm_up) begin_counting(now);
  }
  if (phase_ == Phase::kCounting) {
    vanish_due(now);
    stall_due(now);
    churn_due(now);
    if (interrupted_ || seconds(now - counting_since_) >= plan_.seconds) end_counting(now);
  }
  if (now >= next_look_) {
    next_look_ += kSecond;
    look_at_server();
    if (phase_ == Phase::kCounting && now > counting_since_ + kSecond / 2) note_moment(now);
  }
  if (phase_ == Phase::kSettling && (interrupted_ || seconds(now - settling_since_) >= plan_.settle)) {
    look_at_server();
    phase_ = Phase::kDone;
  }
}

void Run::connect_due(std::int64_t now) {
  const auto due = static_cast<std::size_t>(seconds(now - began_) * plan_.connects_per_second) + 1;
  for (std::size_t i = 0; i < std::min(due, slots_.size()); ++i)
    if (!slots_[i].connection) connect(slots_[i], crowd_[i], now);
}

void Run::connect(Slot& slot, const ClientPlan& who, std::int64_t now) {
  auto machine = std::make_unique<ClientMachine>(who, plan_.machine, route_, commons_, slot.pictures, now);
  if (phase_ == Phase::kCounting) machine->begin_counting(now);
  LinkShape link = plan_.link;
  if (who.role == Role::kSlow) link.bytes_per_second = plan_.slow_bytes_per_second;
  slot.connection = std::make_shared<LoadConnection>(io_, server_, std::move(machine), link);
  slot.waits_seen = 0;
  slot.frames_seen = slot.no_changes_seen = 0;
  slot.recorded = false;
  slot.connection->start();
}

// A slow client's first frame may take minutes: nobody waits for it.
bool Run::all_ready() const {
  return std::all_of(slots_.begin(), slots_.end(), [](const Slot& slot) {
    if (!slot.connection) return false;
    const auto& machine = slot.connection->machine();
    return machine.plan().role == Role::kSlow || machine.figures().first_frame_us > 0 || slot.connection->gone();
  });
}

void Run::begin_counting(std::int64_t now) {
  phase_ = Phase::kCounting;
  counting_since_ = now;
  report_.seconds_to_ready = seconds(now - began_);
  report_.all_ready = std::all_of(slots_.begin(), slots_.end(), [](const Slot& slot) {
    return slot.connection && (slot.connection->machine().plan().role == Role::kSlow ||
                               slot.connection->machine().figures().first_frame_us > 0);
  });
  for (auto& slot : slots_)
    if (slot.connection) slot.connection->machine().begin_counting(now);
  next_look_ = now + kSecond;
  look_at_server();
  harness_cpu_before_ = harness_cpu_moment_ = harness_cpu_;
  server_cpu_before_ = server_cpu_moment_ = server_cpu_;
}

void Run::end_counting(std::int64_t now) {
  look_at_server();
  const double took = std::max(seconds(now - counting_since_), 1e-3);
  report_.seconds = took;
  report_.harness_cpu_seconds_per_second = (harness_cpu_ - harness_cpu_before_) / took;
  if (server_cpu_ && server_cpu_before_)
    report_.server_cpu_seconds_per_second = (*server_cpu_ - *server_cpu_before_) / took;
  for (auto& slot : slots_) {
    if (!slot.connection) continue;
    record(slot, now);
    slot.connection->leave();
    slot.connection->drop();
  }
  phase_ = Phase::kSettling;
  settling_since_ = now;
}

// In the first half of the counted time, so that the second shows what comes of it; every other one is broken off, the
// rest fall silent.
void Run::vanish_due(std::int64_t now) {
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (crowd_[i].role != Role::kVanishing || !slots_[i].connection || slots_[i].connection->by_plan()) continue;
    const double at = plan_.seconds / 2 * chance(crowd_[i].seed, 5);
    if (seconds(now - counting_since_) < at) continue;
    slots_[i].connection->machine().end_counting(now);
    slots_[i].connection->vanish(i % 2 == 0);
  }
}

// All at once; those that draw go on, with what they have.
void Run::stall_due(std::int64_t now) {
  const double from = plan_.seconds / 2;
  const double at = seconds(now - counting_since_);
  if (plan_.crowd.stall == 0 || at < from) return;
  if (!std::exchange(stalled_, true)) {
    for (std::size_t i = 0; i < slots_.size(); ++i)
      if (crowd_[i].role == Role::kStalling && slots_[i].connection)
        slots_[i].connection->stall(now + static_cast<std::int64_t>(plan_.stall_seconds * 1e6));
    if (pictures_) drawn_before_ = pictures_->counts().drawn;
  }
  if (pictures_ && at < from + plan_.stall_seconds)
    report_.drawn_while_stalled = pictures_->counts().drawn - drawn_before_;
}

// Healthy clients that do not decode leave in turn (plan_crowd() has seen to it that there are some), and somebody else
// takes their place.
void Run::churn_due(std::int64_t now) {
  const double until = std::min(seconds(now - counting_since_), plan_.seconds - kLastJoin);
  const auto due = static_cast<std::uint64_t>(std::max(until, 0.0) * plan_.crowd.churn);
  for (; churned_ < due; ++churned_) {
    for (std::size_t tries = 0; tries < slots_.size(); ++tries) {
      const std::uint32_t i = next_leaver_++ % static_cast<std::uint32_t>(slots_.size());
      if (crowd_[i].role != Role::kHealthy || crowd_[i].decodes || !slots_[i].connection) continue;
      slots_[i].connection->leave();
      record(slots_[i], now);
      ClientPlan next = crowd_[i];
      next.seed += 1'000'003 * (churned_ + 1);
      connect(slots_[i], next, now);
      ++report_.joins;
      break;
    }
  }
}

void Run::record(Slot& slot, std::int64_t now) {
  if (slot.recorded) return;
  slot.recorded = true;
  auto& connection = *slot.connection;
  connection.machine().end_counting(now);
  ClientRecord record{connection.machine().plan().role, connection.machine().figures(), false};
  record.cut_off = connection.gone() && !connection.by_plan();
  if (connection.gone()) ++report_.disconnects[connection.end()];
  if (!connection.gone() && connection.by_plan()) ++report_.disconnects["vanished"];
  records_.push_back(std::move(record));
}

void Run::look_at_server() {
  harness_cpu_ = own_cpu_seconds();
  if (plan_.server_pid <= 0) return;
  const auto usage = usage_of(plan_.server_pid);
  if (!usage) return;
  server_cpu_ = usage->cpu_seconds;
  note(report_.server_rss_bytes, usage->rss_bytes);
  note(report_.server_descriptors, usage->descriptors);
}

void Run::note_moment(std::int64_t now) {
  Moment moment;
  moment.t = seconds(now - counting_since_);
  const double took = moment.t - (report_.moments.empty() ? 0.0 : report_.moments.back().t);
  std::vector<float> waits;
  std::uint64_t frames = 0, no_changes = 0, clients = 0;
  for (auto& slot : slots_) {
    if (!slot.connection || slot.connection->machine().plan().role != Role::kHealthy) continue;
    const auto& f = slot.connection->machine().figures();
    waits.insert(waits.end(), f.waits_ms.begin() + static_cast<std::ptrdiff_t>(slot.waits_seen), f.waits_ms.end());
    slot.waits_seen = f.waits_ms.size();
    frames += f.stream_frames - std::exchange(slot.frames_seen, f.stream_frames);
    no_changes += f.no_changes - std::exchange(slot.no_changes_seen, f.no_changes);
    ++clients;
  }
  moment.answer_ms = percentiles(std::move(waits));
  const double share = clients > 0 && took > 0 ? 1.0 / (static_cast<double>(clients) * took) : 0.0;
  moment.stream_frames = static_cast<double>(frames) * share;
  moment.no_changes = static_cast<double>(no_changes) * share;
  if (took > 0) moment.harness_cpu = (harness_cpu_ - std::exchange(harness_cpu_moment_, harness_cpu_)) / took;
  if (server_cpu_ && server_cpu_moment_ && took > 0)
    moment.server_cpu = (*server_cpu_ - *std::exchange(server_cpu_moment_, server_cpu_)) / took;
  report_.moments.push_back(moment);
}

void Run::finish_report() {
  if (pictures_) report_.pictures = pictures_->counts();
  report_.all = summarise(records_, std::nullopt);
  report_.all.faults.add(Fault::kUndecodable, report_.pictures.refused);
  for (std::size_t i = 0; i < kRoles; ++i) report_.by_role[i] = summarise(records_, static_cast<Role>(i));
}

}  // namespace

Result<LoadReport> run_load(LoadPlan plan) { return Run(std::move(plan)).execute(); }

}  // namespace darm::client::load
