// darmd inspect: what a scene holds, how its atlas is packed, and what a camera needs of it.
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "actors/atlas/atlas_report.hpp"
#include "actors/atlas/build_layout.hpp"
#include "actors/atlas/shelf_pack.hpp"
#include "actors/renderer/exposure.hpp"
#include "actors/renderer/plan_cost.hpp"
#include "actors/scene/effect_plan.hpp"
#include "actors/tile_scheduler/view_report.hpp"
#include "daemon/commands.hpp"
#include "daemon/lifecycle/stop_signals.hpp"
#include "daemon/scene_setup.hpp"
#include "daemon/world.hpp"

namespace darm {
namespace {

using nlohmann::json;

struct Inspected {
  std::shared_ptr<const scene::Scene> scene;
  std::shared_ptr<const atlas::Layout> layout;
  std::shared_ptr<const renderer::trace::RayScene> rays;
  std::shared_ptr<const renderer::LightTransport> transport;
  float exposure = 1;
  double load_seconds = 0;
  atlas::LayoutTimes times;
};

Result<Inspected> load(const config::Config& config) {
  Inspected out;
  const unsigned threads = thread_count(config);
  const auto start = std::chrono::steady_clock::now();
  auto scene = load_configured_scene(config);
  if (!scene) return std::unexpected(scene.error());
  out.scene = std::move(*scene);
  out.load_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  atlas::LayoutOptions options;
  options.q = static_cast<float>(config.scene.q);
  options.max_texels = config.atlas.max_texels;
  options.threads = threads;
  auto layout = atlas::build_layout(*out.scene, options, &out.times);
  if (!layout) return std::unexpected(layout.error());
  out.layout = std::move(*layout);
  auto rays = renderer::trace::RayScene::build(out.scene, threads);
  if (!rays) return std::unexpected(rays.error());
  out.rays = std::move(*rays);
  out.transport = std::make_shared<const renderer::LightTransport>(out.scene, out.rays);
  out.exposure =
      config.scene.exposure > 0 ? static_cast<float>(config.scene.exposure) : renderer::scene_exposure(*out.transport);
  return out;
}

json describe_scene(const Inspected& in) {
  json report = {{"file", in.scene->path},
                 {"triangles", in.scene->triangle_count()},
                 {"meshes", in.scene->meshes.size()},
                 {"instances", in.scene->instances.size()},
                 {"materials", in.scene->materials.size()},
                 {"images", in.scene->images.size()},
                 {"lights", in.scene->lights.size()},
                 {"warnings", in.scene->warnings},
                 {"exposure", in.exposure}};
  report["integrator"] = renderer::to_string(in.transport->effects());
  for (const auto& effect : in.transport->plan().effects) {
    report["effects"].push_back({{"name", effect.name}, {"needed", effect.needed}, {"reason", effect.reason}});
  }
  return report;
}

void describe_atlas(const Inspected& in, json& report) {
  const auto atlas = atlas::report_atlas(*in.layout);
  report["patches"] = atlas.patches;
  report["q"] = atlas.q;
  report["surface_area"] = atlas.surface_area;
  report["occupancy"] = atlas.occupancy;
  for (const auto& level : atlas.levels) {
    report["levels"].push_back(
        {{"density", level.density}, {"width", level.width}, {"height", level.height}, {"occupancy", level.occupancy}});
  }
  json dropped = {{"total", 0}, {"reasons", json::array()}};
  std::uint64_t total = 0;
  for (const auto& entry : atlas::dropped_triangles(*in.scene, *in.layout)) {
    dropped["reasons"].push_back({{"reason", entry.reason}, {"count", entry.count}});
    dropped["total"] = total += entry.count;
  }
  report["dropped_triangles"] = dropped;
  report["seconds"] = {{"load", in.load_seconds}, {"parameterise", in.times.parameterise}, {"pack", in.times.pack}};
}

json to_json(const renderer::SpeedRatio& speed) {
  return {{"paths_per_second", speed.rate}, {"peer", speed.peer},
          {"ratio", speed.ratio},           {"quartiles", {speed.low, speed.median, speed.high}},
          {"paths", speed.paths},           {"different", speed.different}};
}

/// What the plan saves against an integrator with everything on, and the time of a path with each effect over without.
Result<void> measure_plan(const InspectCommand& command, const Inspected& in, json& report) {
  if (!command.measure) return {};
  renderer::CostView view;
  view.camera = start_camera(command.config, *in.scene);
  if (!command.cameras.empty()) {
    const auto camera = find_camera(command.config, *in.scene, command.cameras.front());
    if (!camera) return std::unexpected(camera.error());
    view.camera = *camera;
  }
  const unsigned threads = thread_count(command.config);
  const auto plan = renderer::measure_plan(*in.transport, view, threads);
  if (!plan) return std::unexpected(plan.error());
  report["plan"] = {{"over_all_effects", to_json(plan->planned)}, {"over_all_and_filters", to_json(plan->filtered)}};
  const auto costs = renderer::measure_effects(*in.transport, view, threads);
  if (!costs) return std::unexpected(costs.error());
  for (const auto& cost : *costs)
    for (auto& effect : report["effects"])
      if (effect["name"] == cost.effect)
        effect["time_over_without"] = {{"ratio", cost.ratio}, {"quartiles", {cost.low, cost.high}}};
  return {};
}

json to_json(const std::string& camera, const tile_scheduler::ViewReport& view) {
  return {{"camera", camera},
          {"visible_texels", view.visible_texels},
          {"visible_tiles", view.visible_tiles},
          {"efficiency", view.efficiency},
          {"covered", view.covered}};
}

/// Views under our packing and, beside them, under the paper's, which has level 0 alone.
Result<void> describe_views(const InspectCommand& command, const Inspected& in, json& report) {
  if (command.cameras.empty()) return {};
  atlas::Layout paper = *in.layout;
  paper.levels.assign(1, atlas::shelf_pack(*in.layout));
  const unsigned threads = thread_count(command.config);
  for (const auto& spec : command.cameras) {
    auto camera = find_camera(command.config, *in.scene, spec);
    if (!camera) return std::unexpected(camera.error());
    const Viewport viewport{command.width, command.height};
    auto view = to_json(spec, tile_scheduler::report_view(*in.layout, *in.rays, *camera, viewport, threads));
    view["paper"] = to_json(spec, tile_scheduler::report_view(paper, *in.rays, *camera, viewport, threads));
    if (!report.contains("visible_texels")) {  // the first camera's figures also stand at the top
      for (const char* key : {"visible_texels", "visible_tiles", "efficiency"}) report[key] = view[key];
    }
    report["views"].push_back(view);
  }
  return {};
}

void print(const json& r) {
  std::printf("%s\n", r["file"].get<std::string>().c_str());
  std::printf("  %llu triangles, %llu instances, %llu materials, %llu images, %llu lights; exposure %.4g\n",
              r["triangles"].get<unsigned long long>(), r["instances"].get<unsigned long long>(),
              r["materials"].get<unsigned long long>(), r["images"].get<unsigned long long>(),
              r["lights"].get<unsigned long long>(), r["exposure"].get<double>());
  for (const auto& text : r["warnings"]) std::printf("  warning: %s\n", text.get<std::string>().c_str());
  std::printf("atlas: %u patches on %.1f m2 at q = %g\n", r["patches"].get<unsigned>(), r["surface_area"].get<double>(),
              r["q"].get<double>());
  for (const auto& level : r["levels"]) {
    std::printf("  %8.3f texels/m  %6u x %-6u  occupancy %.3f\n", level["density"].get<double>(),
                level["width"].get<unsigned>(), level["height"].get<unsigned>(), level["occupancy"].get<double>());
  }
  std::printf("dropped triangles: %llu\n", r["dropped_triangles"]["total"].get<unsigned long long>());
  for (const auto& entry : r["dropped_triangles"]["reasons"]) {
    std::printf("  %8llu  %s\n", entry["count"].get<unsigned long long>(), entry["reason"].get<std::string>().c_str());
  }
  std::printf("seconds: load %.2f, parameterise %.2f, pack %.2f\n", r["seconds"]["load"].get<double>(),
              r["seconds"]["parameterise"].get<double>(), r["seconds"]["pack"].get<double>());
  std::printf("effects (the integrator that runs holds: %s):\n", r["integrator"].get<std::string>().c_str());
  for (const auto& effect : r["effects"]) {
    std::printf("  %-3s %-24s %s", effect["needed"].get<bool>() ? "yes" : "no",
                effect["name"].get<std::string>().c_str(), effect["reason"].get<std::string>().c_str());
    if (effect.contains("time_over_without"))
      std::printf("; a path takes %.2f times what it takes without",
                  effect["time_over_without"]["ratio"].get<double>());
    std::printf("\n");
  }
  if (r.contains("plan"))
    std::printf("  paths a second over those with everything on: %.2f; with ray filters everywhere too: %.2f\n",
                r["plan"]["over_all_effects"]["ratio"].get<double>(),
                r["plan"]["over_all_and_filters"]["ratio"].get<double>());
  if (!r.contains("views")) return;
  std::printf("views (texels read, tiles touched, efficiency; the paper's packing beside):\n");
  for (const auto& view : r["views"]) {
    std::printf("  %-16s %9llu %6llu %.3f   paper %9llu %6llu %.3f\n", view["camera"].get<std::string>().c_str(),
                view["visible_texels"].get<unsigned long long>(), view["visible_tiles"].get<unsigned long long>(),
                view["efficiency"].get<double>(), view["paper"]["visible_texels"].get<unsigned long long>(),
                view["paper"]["visible_tiles"].get<unsigned long long>(), view["paper"]["efficiency"].get<double>());
  }
}

}  // namespace

int run(const InspectCommand& command) {
  lifecycle::release_stop_signals();  // there is nothing to keep
  const auto failed = [](const Error& error) {
    std::fprintf(stderr, "darmd inspect: %s\n", error.message.c_str());
    return 1;
  };
  const auto in = load(command.config);
  if (!in) return failed(in.error());
  auto report = describe_scene(*in);
  describe_atlas(*in, report);
  if (const auto measured = measure_plan(command, *in, report); !measured) return failed(measured.error());
  if (const auto views = describe_views(command, *in, report); !views) return failed(views.error());
  if (command.json) {
    std::printf("%s\n", report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
  } else {
    print(report);
  }
  return 0;
}

}  // namespace darm
