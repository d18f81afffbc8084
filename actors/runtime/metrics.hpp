// Metrics without a metrics library: who measures something takes a MetricSink&.
#pragma once

#include <initializer_list>
#include <string_view>

namespace darm::runtime {

struct Label {
  std::string_view key;
  std::string_view value;
};
/// Labels of one measurement, e.g. `{{"stage", "encode"}}`. Values come from small fixed sets, never from clients.
using Labels = std::initializer_list<Label>;

/// Where measurements go. Thread-safe, never throws, cheap (a look-up and an addition). Names are `darm_*` in base
/// units; one name is always used with the same method and the same label keys.
class MetricSink {
 public:
  virtual ~MetricSink() = default;
  /// Adds `n` >= 0 to the counter `name` (ends in `_total`).
  virtual void count(std::string_view name, double n = 1, Labels labels = {}) = 0;
  /// Adds one observation to the histogram `name` (ends in `_seconds` for times).
  virtual void observe(std::string_view name, double value, Labels labels = {}) = 0;
  /// Sets the gauge `name`.
  virtual void set(std::string_view name, double value, Labels labels = {}) = 0;
};

/// Swallows everything; the default where nobody measures.
[[nodiscard]] MetricSink& null_metrics();

}  // namespace darm::runtime
