// darm-bench NAME --scene F --json: figures of the whole system, each with its peer beside it.
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "tests/bench/darm_bench/effects.hpp"
#include "tests/bench/darm_bench/frame_streaming.hpp"
#include "tests/bench/darm_bench/raytrace.hpp"
#include "tests/bench/darm_bench/time_to_quality.hpp"

namespace {

int print(const darm::Result<nlohmann::json>& report, bool json) {
  if (!report) {
    std::fprintf(stderr, "darm-bench: %s\n", report.error().message.c_str());
    return 1;
  }
  std::printf("%s\n", report->dump(json ? -1 : 2).c_str());
  return 0;
}

// Not in the working folder: a store is some hundred megabytes, and the next commit would have it.
std::string bench_folder() { return (std::filesystem::temp_directory_path() / "darm-bench").string(); }

void declare_time_to_quality(CLI::App& app, darm::bench::TimeToQualityOptions& o) {
  app.add_option("--scene", o.scene, "glTF file (default: the set-up's)");
  app.add_option("--config", o.config, "set-up, e.g. config/scenes/sponza.toml");
  app.add_option("--camera", o.cameras, "a camera as darmd takes it; more than one: a client each, all at once")
      ->required()
      ->expected(1, 64);
  app.add_option("--reference", o.references,
                 "BASE of BASE.a.pfm and BASE.b.pfm, one a camera (default: rendered once)");
  app.add_option("--state-dir", o.state_dir, "keeps layouts and references; its radiance stores are deleted")
      ->default_val(bench_folder());
  app.add_option("--target", o.target_db, "dB")->capture_default_str();
  app.add_option("--seconds", o.seconds, "how long the clients watch")->capture_default_str();
  app.add_option("--truth", o.truth_seconds,
                 "then let light go on for so long and compare with what it has become, without codec");
  app.add_flag("!--no-frames", o.frames, "do not trace camera frames beside");
  app.add_option("--q", o.q, "texels per world unit (default: the set-up's)");
}

void declare_raytrace(CLI::App& app, darm::bench::RaytraceOptions& o) {
  app.add_option("--scene", o.scene, "glTF file (default: the set-up's)");
  app.add_option("--config", o.config, "set-up, e.g. config/scenes/sponza.toml");
  app.add_option("--camera", o.camera, "a camera as darmd takes it (default: where a client starts)");
  app.add_option("--state-dir", o.state_dir, "keeps layouts; its radiance stores are deleted")
      ->default_val(bench_folder());
  app.add_option("--tiles", o.tiles, "tiles to shade, of those the camera sees")->capture_default_str();
  app.add_option("--q", o.q, "texels per world unit (default: the set-up's)");
  app.add_flag("--all-effects", o.all_effects, "the integrator with everything on");
}

void declare_effects(CLI::App& app, darm::bench::EffectsOptions& o) {
  app.add_option("--scene", o.scene, "glTF file (default: the set-up's)");
  app.add_option("--config", o.config, "set-up, e.g. config/scenes/sponza.toml");
  app.add_option("--camera", o.camera, "a camera as darmd takes it (default: where a client starts)");
  app.add_option("--seconds", o.seconds, "processor time of each comparison")->capture_default_str();
}

}  // namespace

int main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_logger_mt("bench"));  // standard output is the figures' alone
  CLI::App app("darm-bench: figures of the whole system, each with its peer beside it");
  app.require_subcommand(1);
  bool json = false;
  darm::bench::TimeToQualityOptions quality;
  auto* time = app.add_subcommand("time-to-quality", "seconds until a picture is good, beside tracing camera frames");
  declare_time_to_quality(*time, quality);
  time->add_flag("--json", json, "one line of JSON");
  darm::bench::TimeToQualityOptions streams;
  auto* frames =
      app.add_subcommand("frame-streaming", "1, 4 and 8 clients, beside a server that sends each its pictures");
  declare_time_to_quality(*frames, streams);
  frames->add_flag("--json", json, "one line of JSON");
  darm::bench::RaytraceOptions rays;
  auto* trace = app.add_subcommand("raytrace", "rays a second inside the renderer, beside the ray library alone");
  declare_raytrace(*trace, rays);
  trace->add_flag("--json", json, "one line of JSON");
  darm::bench::EffectsOptions plan;
  auto* effects = app.add_subcommand("effects", "what the effect plan saves over everything on, and each effect costs");
  declare_effects(*effects, plan);
  effects->add_flag("--json", json, "one line of JSON");
  CLI11_PARSE(app, argc, argv);
  if (effects->parsed()) return print(darm::bench::effects(plan), json);
  if (frames->parsed()) return print(darm::bench::frame_streaming(streams), json);
  if (trace->parsed()) return print(darm::bench::raytrace(rays), json);
  return print(darm::bench::time_to_quality(quality), json);
}
