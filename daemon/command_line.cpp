#include "daemon/command_line.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/config/load.hpp"
#include "proto/limits.hpp"

namespace darm {
namespace {

/// A finite number from `low` to `high`, or 0 where that means automatic. CLI::Range lets NaN through, and takes 0 and
/// the smallest doubles for one range.
CLI::Validator number(double low, double high, bool or_zero) {
  const auto range = fmt::format("{}{} to {}", or_zero ? "0 or " : "", low, high);
  return {[low, high, or_zero, range](std::string& text) {
            double value = 0;
            const char* last = text.data() + text.size();
            const auto [end, error] = std::from_chars(text.data(), last, value);
            const bool in_range = (value >= low && value <= high) || (or_zero && value == 0);  // false for NaN
            return error == std::errc() && end == last && in_range ? std::string()
                                                                   : "'" + text + "' is not a number, " + range;
          },
          range};
}

const CLI::Validator kNotEmpty(
    [](std::string& text) { return text.empty() ? std::string("must not be empty") : std::string(); }, "");

/// Options that every subcommand has, and the overrides they ask for.
struct Common {
  std::vector<std::filesystem::path> config_files;
  std::string scene;
  std::string state_dir;
  std::optional<double> q;
  std::optional<double> exposure;
  std::optional<unsigned> threads;
  bool json = false;

  void add_to(CLI::App& app, bool scene_is_positional) {
    app.add_option("--config", config_files, "TOML file; may be given several times, a later one overrides")
        ->check(kNotEmpty);
    app.add_option(scene_is_positional ? "scene,--scene" : "--scene", scene, "glTF or GLB file to load")
        ->check(kNotEmpty);
    app.add_option("--state-dir", state_dir, "folder of caches and radiance store")->check(kNotEmpty);
    app.add_option("--q", q, "texels per metre of level 0 (0: automatic)")->check(number(0.001, 65536, true));
    app.add_option("--exposure", exposure, "display = sRGB(clamp(exposure * nits)) (0: automatic)")
        ->check(number(1e-12, 1e12, true));
    app.add_option("--threads", threads, "threads for long work (0: one per core)")->check(CLI::Range(0, 1024));
  }
};

struct ServeOptions {
  Common common;
  std::optional<int> tcp_port, udp_port, http_port, metrics_port;
  std::optional<std::string> address;
  bool allow_lossless = false;
  std::uint64_t seed = 0;
};

void print_faults(const std::vector<config::Fault>& faults) {
  for (const auto& fault : faults) std::fprintf(stderr, "darmd: %s\n", fault.to_string().c_str());
}

/// The configuration of files and overrides, or nothing after its faults have been printed.
std::optional<config::Config> configure(const Common& common, const ServeOptions* serve) {
  auto loaded = config::load(common.config_files);
  if (!loaded) {
    print_faults(loaded.error());
    return std::nullopt;
  }
  auto& config = *loaded;
  if (!common.scene.empty()) config.scene.file = common.scene;
  if (!common.state_dir.empty()) config.state.dir = common.state_dir;
  if (common.q) config.scene.q = *common.q;
  if (common.exposure) config.scene.exposure = *common.exposure;
  if (common.threads) config.render.threads = *common.threads;
  if (serve != nullptr) {
    if (serve->tcp_port) config.listen.tcp_port = *serve->tcp_port;
    if (serve->udp_port) config.listen.udp_port = *serve->udp_port;
    if (serve->http_port) config.listen.http_port = *serve->http_port;
    if (serve->metrics_port) config.listen.metrics_port = *serve->metrics_port;
    if (serve->address) config.listen.address = *serve->address;
    if (serve->allow_lossless) config.stream.allow_lossless = true;
  }
  if (const auto faults = config::check(config); !faults.empty()) {
    print_faults(faults);
    return std::nullopt;
  }
  return config;
}

/// "WIDTHxHEIGHT", each 1..16384.
bool parse_size(const std::string& text, std::uint32_t& width, std::uint32_t& height) {
  int consumed = 0;
  unsigned w = 0;
  unsigned h = 0;
  if (std::sscanf(text.c_str(), "%5ux%5u%n", &w, &h, &consumed) != 2 || consumed != static_cast<int>(text.size())) {
    return false;
  }
  if (w < 1 || h < 1 || w > 16384 || h > 16384) return false;
  width = w;
  height = h;
  return true;
}

const CLI::Validator kSize(
    [](std::string& text) {
      std::uint32_t w = 0;
      std::uint32_t h = 0;
      return parse_size(text, w, h) ? std::string() : "'" + text + "' is not WIDTHxHEIGHT with 1..16384 pixels a side";
    },
    "WxH");

const CLI::Range kPort(0, 65535);

/// Where pictures go: refused before the work, not after.
const CLI::Validator kPngPath(
    [](std::string& text) {
      const std::filesystem::path path(text);
      const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
      if (path.extension() != ".png") return "'" + text + "' does not end in .png";
      return std::filesystem::is_directory(folder) ? std::string() : "folder " + folder.string() + " does not exist";
    },
    "FILE.png");

void add_serve(CLI::App& app, ServeOptions& options) {
  options.common.add_to(app, false);
  app.add_option("--tcp-port", options.tcp_port, "clients connect here (0: any free port)")->check(kPort);
  app.add_option("--udp-port", options.udp_port, "cameras arrive here (0: any free port)")->check(kPort);
  app.add_option("--http-port", options.http_port, "the web client, HTTP and HTTPS (0: any free port, -1: off)")
      ->check(CLI::Range(-1, 65535));
  app.add_option("--metrics-port", options.metrics_port, "Prometheus (0: any free port, -1: off)")
      ->check(CLI::Range(-1, 65535));
  app.add_option("--address", options.address, "address to listen on");
  app.add_flag("--allow-lossless", options.allow_lossless, "let clients ask for uncompressed tiles (evaluation)");
  app.add_option("--seed", options.seed, "seed of the light's sample sequences");
}

void add_inspect(CLI::App& app, InspectCommand& command, Common& common, std::string& size) {
  common.add_to(app, true);
  app.add_option("--camera", command.cameras, "\"px,py,pz tx,ty,tz fovy\" or a name; may be given several times");
  app.add_option("--size", size, "picture size of the camera")->check(kSize);
  app.add_flag("--measure", command.measure, "measure what each effect costs, on paths of the first camera");
  app.add_flag("--json", command.json, "machine-readable report");
}

void add_render(CLI::App& app, RenderCommand& command, Common& common, std::string& size, std::string& effects) {
  common.add_to(app, true);
  app.add_option("--camera", command.camera, "\"px,py,pz tx,ty,tz fovy\" or a name")->required();
  app.add_option("--size", size, "picture size")->check(kSize);
  auto* spp = app.add_option("--spp", command.spp, "samples per pixel, both halves together; rounded up to even")
                  ->check(CLI::Range(2, 1 << 20));
  auto* psnr = app.add_option("--until-psnr", command.until_psnr,
                              "stop when the reference's own PSNR is this many dB, with --spp at the latest then")
                   ->check(number(1, 100, false));
  app.add_option("--effects", effects, "full or view-independent")->check(CLI::IsMember({"full", "view-independent"}));
  app.add_flag("--all-effects", command.all_effects,
               "compile-time plan off: every effect's code runs; the picture is the same (for comparison)");
  app.add_option("--seed", command.seed, "seed of the sample sequences");
  app.add_option("--out", command.out, "picture (.png); .pfm, .a.pfm, .b.pfm (halves) and .json are written beside it")
      ->required()
      ->check(kPngPath);
  app.add_flag("--json", command.json, "machine-readable report");
  app.callback([spp, psnr] {
    if (spp->empty() && psnr->empty()) throw CLI::RequiredError("--spp N or --until-psnr P");
  });
}

void add_accuracy(CLI::App& app, AccuracyCommand& command, Common& common, std::string& size) {
  common.add_to(app, true);
  app.add_option("--out", command.out, "folder of the report; results that are in it are not measured again")
      ->required()
      ->check(kNotEmpty);
  app.add_option("--cameras,--camera", command.cameras,
                 "\"px,py,pz tx,ty,tz fovy\" or a name, one or more (default: the first of the set-up)")
      ->expected(1, 64);
  app.add_option("--seconds", command.seconds,
                 "length of a run; the balanced preset, samples and camera frames take two")
      ->check(number(0.5, 3600, false))
      ->capture_default_str();
  app.add_option("--only", command.only,
                 "groups (presets, q, samples, indirect, filter, layers, frames, codec, effects) or variants by name")
      ->delimiter(',');
  app.add_option("--size", size, "picture size")->check(kSize);
  app.add_option("--reference-psnr", command.reference_psnr, "the references' own accuracy, dB")
      ->check(number(1, 100, false))
      ->capture_default_str();
  app.add_flag("--json", command.json, "accuracy.json on standard output, no progress");
}

// What is wrong with the first argument, if it is to be a command; empty: nothing.
std::string fault_of_command(const CLI::App& app, int argc, char** argv) {
  const std::string_view first = argc > 1 ? argv[1] : "";
  if (first.starts_with('-')) return {};
  std::string known;
  for (const auto* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (command->get_name() == first) return {};
    known += (known.empty() ? "" : ", ") + command->get_name();
  }
  return (first.empty() ? "no command" : fmt::format("\"{}\": no such command", first)) + "; known are " + known +
         "; darmd COMMAND --help tells more";
}

}  // namespace

Command parse_command_line(int argc, char** argv) {
  CLI::App app{"darmd streams ray-traced light of a glTF scene to thin clients"};
  app.require_subcommand(1);
  app.set_version_flag("--version", "darmd 0.1.0, protocol " + std::to_string(proto::kProtocolVersion));

  ServeOptions serve;
  auto* serve_app = app.add_subcommand("serve", "run the daemon");
  add_serve(*serve_app, serve);

  InspectCommand inspect;
  Common inspect_common;
  std::string size = "1280x720";
  auto* inspect_app = app.add_subcommand("inspect", "report what a scene holds and how its atlas is packed");
  add_inspect(*inspect_app, inspect, inspect_common, size);

  RenderCommand render;
  Common render_common;
  std::string effects = "full";
  auto* render_app = app.add_subcommand("render", "path-trace an unbiased reference picture");
  add_render(*render_app, render, render_common, size, effects);

  AccuracyCommand accuracy;
  Common accuracy_common;
  auto* accuracy_app = app.add_subcommand("accuracy", "measure what accuracy costs in time, and write a report");
  add_accuracy(*accuracy_app, accuracy, accuracy_common, size);

  if (const std::string fault = fault_of_command(app, argc, argv); !fault.empty()) {
    std::fprintf(stderr, "darmd: %s\n", fault.c_str());
    return Exit{2};
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return Exit{app.exit(error)};
  }
  if (serve_app->parsed()) {
    auto config = configure(serve.common, &serve);
    if (!config) return Exit{1};
    return ServeCommand{std::move(*config), serve.seed};
  }
  const Common& common = inspect_app->parsed()  ? inspect_common
                         : render_app->parsed() ? render_common
                                                : accuracy_common;
  auto config = configure(common, nullptr);
  if (!config) return Exit{1};
  if (inspect_app->parsed()) {
    inspect.config = std::move(*config);
    parse_size(size, inspect.width, inspect.height);
    return inspect;
  }
  if (accuracy_app->parsed()) {
    accuracy.config = std::move(*config);
    parse_size(size, accuracy.width, accuracy.height);
    return accuracy;
  }
  render.config = std::move(*config);
  render.view_independent = effects == "view-independent";
  parse_size(size, render.width, render.height);
  return render;
}

}  // namespace darm
