#include "daemon/effect_metrics.hpp"

#include <algorithm>
#include <string>

namespace darm {
namespace {

// "alpha test" -> "alpha_test", "vertex colours" -> "vertex_colors": labels are spelt as the counters' are.
std::string label_of(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '_');
  if (const auto at = name.find("colours"); at != std::string::npos) name.replace(at, 7, "colors");
  return name;
}

}  // namespace

EffectMetrics::EffectMetrics(runtime::MetricSink& sink, const scene::EffectPlan& plan)
    : sink_(sink), reported_(renderer::effect_counts()) {
  for (const auto& effect : plan.effects)
    sink_.set("darm_renderer_effect", effect.needed ? 1 : 0, {{"effect", label_of(effect.name)}});
  // All series are there from the start: 0 is an answer.
  for (std::size_t i = 0; i < renderer::kEffectKinds; ++i)
    sink_.count("darm_renderer_effect_runs_total", 0,
                {{"effect", renderer::label_of(static_cast<renderer::EffectKind>(i))}});
}

void EffectMetrics::report() {
  const auto now = renderer::effect_counts();
  for (std::size_t i = 0; i < renderer::kEffectKinds; ++i)
    if (now[i] > reported_[i])
      sink_.count("darm_renderer_effect_runs_total", static_cast<double>(now[i] - reported_[i]),
                  {{"effect", renderer::label_of(static_cast<renderer::EffectKind>(i))}});
  reported_ = now;
}

}  // namespace darm
