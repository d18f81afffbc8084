// Counts what an actor counts.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "actors/runtime/metrics.hpp"

namespace darm::renderer {

class CountingMetrics : public runtime::MetricSink {
 public:
  void count(std::string_view name, double n, runtime::Labels) override { counts[std::string(name)] += n; }
  void observe(std::string_view, double, runtime::Labels) override {}
  void set(std::string_view, double, runtime::Labels) override {}
  std::map<std::string, double> counts;
};

}  // namespace darm::renderer
