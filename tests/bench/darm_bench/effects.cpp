#include "tests/bench/darm_bench/effects.hpp"

#include <thread>

#include "actors/renderer/plan_cost.hpp"
#include "daemon/config/load.hpp"
#include "daemon/scene_setup.hpp"

namespace darm::bench {

namespace {

using nlohmann::json;

json to_json(const renderer::SpeedRatio& speed) {
  return {{"value", speed.rate},  {"peer", speed.peer},
          {"ratio", speed.ratio}, {"quartiles", {speed.low, speed.median, speed.high}},
          {"paths", speed.paths}, {"different", speed.different}};
}

}  // namespace

Result<json> effects(const EffectsOptions& options) {
  std::vector<std::filesystem::path> files;
  if (!options.config.empty()) files.push_back(options.config);
  auto config = config::load(files);
  if (!config) return fail(config::to_string(config.error()));
  if (!options.scene.empty()) config->scene.file = options.scene;
  const auto scene = load_configured_scene(*config);
  if (!scene) return std::unexpected(scene.error());
  const unsigned threads = std::max(1u, std::thread::hardware_concurrency());
  const auto rays = renderer::trace::RayScene::build(*scene, threads);
  if (!rays) return std::unexpected(rays.error());
  const renderer::LightTransport transport(*scene, *rays);
  renderer::CostView view;
  view.seconds = options.seconds;
  view.camera = start_camera(*config, **scene);
  if (!options.camera.empty()) {
    const auto camera = find_camera(*config, **scene, options.camera);
    if (!camera) return std::unexpected(camera.error());
    view.camera = *camera;
  }
  const auto plan = renderer::measure_plan(transport, view, threads);
  if (!plan) return std::unexpected(plan.error());
  const auto costs = renderer::measure_effects(transport, view, threads);
  if (!costs) return std::unexpected(costs.error());
  json report = to_json(plan->planned);
  report["scene"] = (*scene)->path;
  report["integrator"] = renderer::to_string(transport.effects());
  report["filters_everywhere"] = to_json(plan->filtered);
  for (const auto& effect : transport.plan().effects) {
    json entry = {{"name", effect.name}, {"needed", effect.needed}, {"reason", effect.reason}};
    for (const auto& cost : *costs)
      if (cost.effect == effect.name)
        entry["time_over_without"] = {{"ratio", cost.ratio}, {"quartiles", {cost.low, cost.high}}};
    report["effects"].push_back(entry);
  }
  return report;
}

}  // namespace darm::bench
