// Which effects of light the running integrator holds, and how often their code ran, as metrics.
#pragma once

#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/trace/effect_tally.hpp"
#include "actors/runtime/metrics.hpp"

namespace darm {

/// Gauges `darm_renderer_effect{effect}` (1: the plan calls for it) and counters
/// `darm_renderer_effect_runs_total{effect}` (see renderer::EffectKind). One thread.
class EffectMetrics {
 public:
  /// `sink` must outlive it.
  EffectMetrics(runtime::MetricSink& sink, const scene::EffectPlan& plan);
  /// Adds what has run since the last call (or construction). Every second or so.
  void report();

 private:
  runtime::MetricSink& sink_;
  renderer::EffectCounts reported_;
};

}  // namespace darm
