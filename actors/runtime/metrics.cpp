#include "actors/runtime/metrics.hpp"

namespace darm::runtime {
namespace {

class NullMetrics final : public MetricSink {
 public:
  void count(std::string_view, double, Labels) override {}
  void observe(std::string_view, double, Labels) override {}
  void set(std::string_view, double, Labels) override {}
};

}  // namespace

MetricSink& null_metrics() {
  static NullMetrics sink;
  return sink;
}

}  // namespace darm::runtime
