// Metrics as Prometheus reads them: a registry and an HTTP exposer at /metrics.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "actors/runtime/metrics.hpp"
#include "actors/types/error.hpp"

namespace darm::observe {

/// Families come into being with their first measurement. Histograms of names in `_seconds` have buckets from 0.25 ms
/// to 60 s, in `_bytes` from 256 B to 1 GiB, others from 0.001 to 10,000. At most 10,000 series: more are dropped and
/// counted in `darm_metric_series_dropped_total`. Measuring one name by two methods is a bug; it is logged once and
/// dropped. Beside them stand the standard metrics of a process: process_cpu_seconds_total and others.
class PrometheusSink final : public runtime::MetricSink {
 public:
  /// Without an exposer: for tests and subcommands; text() shows what would be served.
  PrometheusSink();
  ~PrometheusSink() override;

  /// Serves http://address:port/metrics on threads of its own, until the end: that takes up to two seconds while
  /// somebody is connected. Port 0: any free one, told by port(). Where IPv6 cannot be served, :: and ::1 are taken for
  /// 0.0.0.0 and 127.0.0.1; url() says what came of it. Error: the address cannot be bound.
  [[nodiscard]] Result<void> expose(const std::string& address, std::uint16_t port);
  /// The port that is served; 0 before expose().
  [[nodiscard]] std::uint16_t port() const;
  /// Where the metrics are, with the address that was bound; empty before expose().
  [[nodiscard]] std::string url() const;
  /// All series in Prometheus' text format.
  [[nodiscard]] std::string text() const;

  void count(std::string_view name, double n, runtime::Labels labels) override;
  void observe(std::string_view name, double value, runtime::Labels labels) override;
  void set(std::string_view name, double value, runtime::Labels labels) override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// What probes and dashboards ask first, as gauges: `darm_ready` (1 once clients can connect, 0 while stopping) and
/// `darm_build_info{version}`. `sink` must outlive it.
class Health {
 public:
  Health(runtime::MetricSink& sink, std::string_view version);
  void set_ready(bool ready);

 private:
  runtime::MetricSink& sink_;
};

}  // namespace darm::observe
