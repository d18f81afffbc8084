#include "daemon/observe/prometheus_sink.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <prometheus/collectable.h>
#include <prometheus/counter.h>
#include <prometheus/exposer.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/metric_family.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <mutex>
#include <shared_mutex>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include "daemon/observe/metric_help.hpp"
#include "daemon/observe/process_stats.hpp"

namespace darm::observe {
namespace {

constexpr std::size_t kMaxSeries = 10'000;
constexpr const char* kDropped = "darm_metric_series_dropped_total";

using Metric = std::variant<prometheus::Counter*, prometheus::Gauge*, prometheus::Histogram*>;

const prometheus::Histogram::BucketBoundaries& buckets_for(std::string_view name) {
  static const prometheus::Histogram::BucketBoundaries seconds = {
      0.00025, 0.0005, 0.001, 0.002, 0.003, 0.005, 0.0075, 0.01, 0.015, 0.02, 0.03, 0.05,
      0.075,   0.1,    0.15,  0.2,   0.3,   0.5,   0.75,   1,    2,     5,    10,   60};
  static const prometheus::Histogram::BucketBoundaries bytes = [] {
    prometheus::Histogram::BucketBoundaries list;
    for (double b = 256; b <= 1 << 30; b *= 4) list.push_back(b);
    return list;
  }();
  static const prometheus::Histogram::BucketBoundaries other = [] {
    prometheus::Histogram::BucketBoundaries list;
    for (double b = 0.001; b <= 10'000; b *= 10)
      for (const double step : {1.0, 2.0, 5.0}) list.push_back(b * step);
    return list;
  }();
  static const prometheus::Histogram::BucketBoundaries errors = {
      // RMS display error, 0..1
      0.0002, 0.0005, 0.001, 0.0015, 0.002, 0.003, 0.005, 0.0075, 0.01, 0.015, 0.02, 0.03, 0.05, 0.1, 0.25};
  if (name.ends_with("_seconds")) return seconds;
  if (name.ends_with("_error")) return errors;
  return name.ends_with("_bytes") ? bytes : other;
}

struct TextHash {
  using is_transparent = void;
  std::size_t operator()(std::string_view text) const { return std::hash<std::string_view>()(text); }
};

// A scrape takes one request and milliseconds. Who connects and says nothing holds a thread until the timeout, so there
// are some to spare, and none is kept for a second request.
constexpr const char* kThreads = "8";
constexpr const char* kRequestTimeoutMs = "2000";

// An IPv6 address is written in brackets, in URLs as in civetweb's listening_ports.
std::string host_and_port(const std::string& address, std::uint16_t port) {
  return address.find(':') == std::string::npos ? fmt::format("{}:{}", address, port)
                                                : fmt::format("[{}]:{}", address, port);
}

// What reaches as far in IPv4: civetweb may have been built without IPv6 (Debian's is). Empty: nothing does.
std::string in_ipv4(const std::string& address) {
  in6_addr parsed{};
  if (inet_pton(AF_INET6, address.c_str(), &parsed) != 1) return {};
  if (std::memcmp(&parsed, &in6addr_any, sizeof parsed) == 0) return "0.0.0.0";
  return std::memcmp(&parsed, &in6addr_loopback, sizeof parsed) == 0 ? "127.0.0.1" : "";
}

// Can anything listen at this IPv4 address? Asked once the HTTP server could not, which does not say why.
bool is_of_this_machine(const std::string& address) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  if (inet_pton(AF_INET, address.c_str(), &at.sin_addr) != 1) return false;
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool bound = fd >= 0 && bind(fd, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
  if (fd >= 0) close(fd);
  return bound;
}

Result<std::unique_ptr<prometheus::Exposer>> make_exposer(const std::string& address, std::uint16_t port) {
  const std::string where = host_and_port(address, port);
  const auto advice = [&address] {
    if (address.find(':') != std::string::npos)
      return "the HTTP server may have been built without IPv6: set listen.address to \"::\", or "
             "listen.metrics_port to -1 (off)";
    return is_of_this_machine(address) ? "is the port taken? set listen.metrics_port (-1: off)"
                                       : "listen.address is no address of this machine; 0.0.0.0 is every one";
  };
  try {
    auto exposer = std::make_unique<prometheus::Exposer>(
        std::vector<std::string>{"listening_ports", where, "num_threads", kThreads, "request_timeout_ms",
                                 kRequestTimeoutMs, "enable_keep_alive", "no"});
    const auto ports = exposer->GetListeningPorts();
    if (!ports.empty() && ports.front() > 0) return exposer;
    return fail(fmt::format("{}: metrics cannot be served there; {}", where, advice()));
  } catch (const std::exception& e) {
    return fail(fmt::format("{}: metrics cannot be served there; {} ({})", where, advice(), e.what()));
  }
}

prometheus::MetricFamily one_value(const char* name, const char* help, prometheus::MetricType type, double value) {
  prometheus::ClientMetric metric;
  if (type == prometheus::MetricType::Counter) {
    metric.counter.value = value;
  } else {
    metric.gauge.value = value;
  }
  return {name, help, type, {metric}};
}

// The standard metrics of a process, read when they are asked for.
class ProcessMetrics final : public prometheus::Collectable {
 public:
  [[nodiscard]] std::vector<prometheus::MetricFamily> Collect() const override {
    using Type = prometheus::MetricType;
    const auto stats = process_stats();
    const auto number = [](std::uint64_t n) { return static_cast<double>(n); };
    return {one_value("process_cpu_seconds_total", "Processor time, user and system", Type::Counter, stats.cpu_seconds),
            one_value("process_resident_memory_bytes", "Memory in use", Type::Gauge, number(stats.resident_bytes)),
            one_value("process_open_fds", "File descriptors in use", Type::Gauge, number(stats.open_descriptors)),
            one_value("process_max_fds", "File descriptors allowed", Type::Gauge, number(stats.most_descriptors))};
  }
};

}  // namespace

class PrometheusSink::Impl {
 public:
  // The series of `name` and `labels`, made if it is new; null if it cannot be.
  template <class M, class Builder>
  M* series(std::string_view name, runtime::Labels labels, Builder build) {
    thread_local std::string key;
    key.assign(name);
    for (const auto& label : labels) key.append(1, '\0').append(label.key).append(1, '\0').append(label.value);
    {
      const std::shared_lock lock(mutex_);
      if (const auto it = series_.find(std::string_view(key)); it != series_.end()) return as<M>(it->second, name);
    }
    const std::unique_lock lock(mutex_);
    if (const auto it = series_.find(std::string_view(key)); it != series_.end()) return as<M>(it->second, name);
    if (series_.size() >= kMaxSeries) {
      dropped_.Increment();
      return nullptr;
    }
    try {
      std::map<std::string, std::string> label_map;
      for (const auto& label : labels) label_map.emplace(label.key, label.value);
      M* made = build(registry_, std::string(name), label_map);
      series_.emplace(key, made);
      return made;
    } catch (const std::exception& e) {
      complain(name, e.what());
      return nullptr;
    }
  }

  prometheus::Registry& registry() { return *registry_ptr_; }
  const std::shared_ptr<prometheus::Registry>& shared_registry() const { return registry_ptr_; }

  std::shared_ptr<ProcessMetrics> process = std::make_shared<ProcessMetrics>();
  std::unique_ptr<prometheus::Exposer> exposer;
  std::uint16_t port = 0;
  std::string url;

 private:
  template <class M>
  M* as(const Metric& metric, std::string_view name) {
    if (auto* const* found = std::get_if<M*>(&metric)) return *found;
    complain(name, "measured by two methods");
    return nullptr;
  }

  void complain(std::string_view name, std::string_view what) {
    if (!complained_.exchange(true)) spdlog::error("metric {}: {}; its measurements are dropped", name, what);
  }

  std::shared_ptr<prometheus::Registry> registry_ptr_ = std::make_shared<prometheus::Registry>();
  prometheus::Registry& registry_ = *registry_ptr_;
  prometheus::Counter& dropped_ =
      prometheus::BuildCounter().Name(kDropped).Help(std::string(metric_help(kDropped))).Register(registry_).Add({});
  std::shared_mutex mutex_;
  std::unordered_map<std::string, Metric, TextHash, std::equal_to<>> series_;
  std::atomic<bool> complained_ = false;
};

PrometheusSink::PrometheusSink() : impl_(std::make_unique<Impl>()) {}
PrometheusSink::~PrometheusSink() = default;

Result<void> PrometheusSink::expose(const std::string& address, std::uint16_t port) {
  std::string bound = address;
  auto exposer = make_exposer(bound, port);
  if (const auto ipv4 = in_ipv4(address); !exposer && !ipv4.empty()) {
    bound = ipv4;
    exposer = make_exposer(bound, port);
  }
  if (!exposer) return std::unexpected(exposer.error());
  (*exposer)->RegisterCollectable(impl_->shared_registry());
  (*exposer)->RegisterCollectable(impl_->process);
  impl_->port = static_cast<std::uint16_t>((*exposer)->GetListeningPorts().front());
  impl_->url = fmt::format("http://{}/metrics", host_and_port(bound, impl_->port));
  impl_->exposer = std::move(*exposer);
  return {};
}

std::string PrometheusSink::url() const { return impl_->url; }

std::uint16_t PrometheusSink::port() const { return impl_->port; }

std::string PrometheusSink::text() const {
  auto families = impl_->registry().Collect();
  for (auto& family : impl_->process->Collect()) families.push_back(std::move(family));
  return prometheus::TextSerializer().Serialize(families);
}

void PrometheusSink::count(std::string_view name, double n, runtime::Labels labels) {
  auto* counter =
      impl_->series<prometheus::Counter>(name, labels, [](auto& registry, const std::string& full, const auto& map) {
        return &prometheus::BuildCounter().Name(full).Help(std::string(metric_help(full))).Register(registry).Add(map);
      });
  if (counter != nullptr && n > 0 && std::isfinite(n)) counter->Increment(n);
}

void PrometheusSink::observe(std::string_view name, double value, runtime::Labels labels) {
  auto* histogram =
      impl_->series<prometheus::Histogram>(name, labels, [](auto& registry, const std::string& full, const auto& map) {
        return &prometheus::BuildHistogram()
                    .Name(full)
                    .Help(std::string(metric_help(full)))
                    .Register(registry)
                    .Add(map, buckets_for(full));
      });
  if (histogram != nullptr && std::isfinite(value)) histogram->Observe(value);
}

void PrometheusSink::set(std::string_view name, double value, runtime::Labels labels) {
  auto* gauge =
      impl_->series<prometheus::Gauge>(name, labels, [](auto& registry, const std::string& full, const auto& map) {
        return &prometheus::BuildGauge().Name(full).Help(std::string(metric_help(full))).Register(registry).Add(map);
      });
  if (gauge != nullptr) gauge->Set(value);
}

Health::Health(runtime::MetricSink& sink, std::string_view version) : sink_(sink) {
  sink_.set("darm_build_info", 1, {{"version", version}});
  // What alerts watch is there from the start: of a series that begins with its first event there is no increase.
  for (const char* what : {"server_full", "address_full", "memory_full", "accept_failed"})
    sink_.count("darm_session_events_total", 0, {{"what", what}});
  for (const char* reason : {"TOO_SLOW", "TIMED_OUT", "PROTOCOL_ERROR", "VERSION_UNSUPPORTED", "FORMAT_REFUSED"})
    sink_.count("darm_sessions_closed_total", 0, {{"reason", reason}});
  sink_.count("darm_renderer_quarantined_samples_total", 0);
  sink_.count("darm_encoder_failures_total", 0);
  sink_.count("darm_encoder_frames_refused_total", 0);
  set_ready(false);
}

void Health::set_ready(bool ready) { sink_.set("darm_ready", ready ? 1 : 0); }

}  // namespace darm::observe
