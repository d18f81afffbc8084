// darm-probe: connects as a client, draws without a window, compares with a reference, reports.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <iostream>

#include "client/core/camera_path.hpp"
#include "client/core/egl_context.hpp"
#include "client/core/number_option.hpp"
#include "client/core/tls_options.hpp"
#include "client/probe/probe_session.hpp"
#include "client/probe/report.hpp"

namespace darm::client::probe {
namespace {

constexpr double kLongest = 1e6;  // seconds
constexpr unsigned kLargestSide = 8192;

// Refused before the session, not after.
const CLI::Validator kWritablePlace(
    [](std::string& text) {
      const std::filesystem::path path(text);
      const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
      std::error_code error;
      if (text.empty() || std::filesystem::is_directory(path, error)) return "'" + text + "' is not the name of a file";
      return std::filesystem::is_directory(folder, error) ? std::string()
                                                          : "folder " + folder.string() + " does not exist";
    },
    "FILE");

Result<void> parse_size(const std::string& text, std::uint32_t& width, std::uint32_t& height) {
  const char* last = text.data() + text.size();
  const auto w = std::from_chars(text.data(), last, width);
  const bool wide = w.ec == std::errc() && w.ptr != last && *w.ptr == 'x' && width >= 1 && width <= kLargestSide;
  const auto h = wide ? std::from_chars(w.ptr + 1, last, height) : w;
  if (wide && h.ec == std::errc() && h.ptr == last && height >= 1 && height <= kLargestSide) return {};
  return fail(fmt::format("--size {}: expected WIDTHxHEIGHT, 1 to {} each", text, kLargestSide));
}

struct Arguments {
  std::string server, camera, setup, size = "1280x720", walkthrough, reference, out, ceiling;
  TlsOptions tls;
  double until_error = -1, target_error = 0, seconds = -1, ceiling_seconds = 0, series_interval = 0,
         updates_per_second = 10;
  std::uint32_t phystex = 2048, ceiling_phystex = 8192, view_phystex = 1024;
  unsigned bench_draw = 0;
  bool lossless = false, no_444 = false, no_udp = false, lag = false, check_first = false, codec_check = false,
       json = false;
};

Result<Reference> read_reference(const std::string& file) {
  std::filesystem::path base(file);
  if (base.extension() == ".pfm") base.replace_extension();
  auto a = read_pfm(base.string() + ".a.pfm");
  if (!a) return std::unexpected(a.error());
  auto b = read_pfm(base.string() + ".b.pfm");
  if (!b) return std::unexpected(b.error());
  return Reference{std::move(*a), std::move(*b)};
}

std::vector<double> draw_times(const Arguments& a, double seconds) {
  std::vector<double> times;
  if (a.series_interval > 0) {
    for (double t = a.series_interval; t < seconds && times.size() < 10000; t += a.series_interval) times.push_back(t);
  } else if (a.walkthrough.empty()) {
    for (const double t : {1, 2, 5, 10, 20, 30, 60, 120, 300, 600}) {
      if (t < seconds) times.push_back(t);
    }
  }
  return times;
}

Result<SessionPlan> make_plan(const Arguments& a) {
  SessionPlan plan;
  if (auto ok = parse_address(a.server, plan.host, plan.port); !ok) return std::unexpected(ok.error());
  if (auto ok = parse_size(a.size, plan.width, plan.height); !ok) return std::unexpected(ok.error());
  plan.tls = a.tls.wanted();
  plan.authority = a.tls.authority;
  plan.updates_per_second = a.updates_per_second;
  plan.seconds = a.seconds;
  if (a.until_error >= 0) {
    plan.until_error = a.until_error;
    if (a.seconds < 0) plan.seconds = 120;
  }
  if (!a.walkthrough.empty()) {
    auto path = read_walkthrough(a.walkthrough);
    if (!path) return std::unexpected(path.error());
    plan.path = std::move(*path);
    if (plan.seconds < 0) plan.seconds = plan.path.back().t - plan.path.front().t;
  } else {
    if (a.camera.empty()) return fail("--camera or --walkthrough is needed");
    auto key = read_camera(a.camera, a.setup);
    if (!key) return std::unexpected(key.error());
    plan.path = {*key};
  }
  if (plan.seconds < 0) plan.seconds = 10;
  plan.draw_times = draw_times(a, plan.seconds);
  plan.max_phystex = a.phystex;
  plan.max_view_phystex = a.view_phystex;
  plan.lossless = a.lossless;
  plan.target_error = a.target_error;
  plan.keep_tiles = a.codec_check;
  plan.udp = !a.no_udp;
  plan.lag = a.lag;
  plan.check_first = a.check_first;
  plan.chroma_444 = !a.no_444;
  return plan;
}

// The same view without codec and with every tile resident: from the cache file, or from a session of its own.
Result<Image8> ceiling_picture(const Arguments& a, SessionPlan plan) {
  if (!a.ceiling.empty() && std::filesystem::exists(a.ceiling)) return read_png(a.ceiling);
  if (a.ceiling_seconds <= 0) return fail(a.ceiling + ": is not there yet; --ceiling-seconds S makes it");
  plan.path = {camera_at(plan.path, plan.path.front().t + plan.seconds)};
  plan.seconds = a.ceiling_seconds;
  plan.until_error.reset();
  plan.draw_times.clear();
  plan.lossless = true;
  plan.lag = false;
  plan.max_phystex = a.ceiling_phystex;
  if (plan.max_view_phystex > 0) plan.max_view_phystex = 2048;
  auto session = run_session(plan, nullptr, 0);
  if (!session) return fail("ceiling: " + session.error().message);
  if (!a.ceiling.empty()) {
    if (auto ok = write_png(a.ceiling, session->picture); !ok) return std::unexpected(ok.error());
  }
  return std::move(session->picture);
}

// The same tiles without codec, from a session beside the first one's light.
Result<std::optional<CodecScore>> check_codec(SessionPlan plan, const SessionReport& coded) {
  plan.path = {camera_at(plan.path, plan.path.front().t + plan.seconds)};
  plan.seconds = 15;
  plan.until_error.reset();
  plan.draw_times.clear();
  plan.lossless = true;
  plan.max_phystex = coded.phystex_size;
  const auto lossless = run_session(plan, nullptr, 0);
  if (!lossless) return fail("codec check: " + lossless.error().message);
  return compare_tiles(coded.tiles, lossless->tiles);
}

Result<void> run(const Arguments& a) {
  auto plan = make_plan(a);
  if (!plan) return std::unexpected(plan.error());
  std::optional<Reference> reference;
  Outcome outcome;
  if (!a.reference.empty()) {
    auto read = read_reference(a.reference);
    if (!read) return std::unexpected(read.error());
    reference = std::move(*read);
    if (reference->a.width != plan->width || reference->a.height != plan->height) {
      return fail(
          fmt::format("{}: is {}x{}, the picture {}", a.reference, reference->a.width, reference->a.height, a.size));
    }
    const auto own = reference_psnr(*reference);
    if (!own) return std::unexpected(own.error());
    outcome.reference_psnr = *own;
  }
  auto context = EglContext::create();
  if (!context) return std::unexpected(context.error());
  auto session = run_session(*plan, reference ? &*reference : nullptr, a.bench_draw);
  if (!session) return std::unexpected(session.error());
  outcome.session = std::move(*session);
  outcome.benched = a.bench_draw > 0;
  if (!a.out.empty()) {
    if (auto ok = write_png(a.out, outcome.session.picture); !ok) return ok;
  }
  if (reference) {
    const auto score = compare(outcome.session.picture, *reference);
    if (!score) return std::unexpected(score.error());
    outcome.score = *score;
  }
  if (a.codec_check) {
    const auto codec = check_codec(*plan, outcome.session);
    if (!codec) return std::unexpected(codec.error());
    outcome.codec = *codec;
  }
  if (a.ceiling_seconds > 0 || !a.ceiling.empty()) {
    const auto ceiling = ceiling_picture(a, *plan);
    if (!ceiling) return std::unexpected(ceiling.error());
    if (!a.out.empty()) {
      if (auto ok = write_png(a.out + ".ceiling.png", *ceiling); !ok) return ok;
    }
    if (reference) {
      const auto score = compare(*ceiling, *reference);
      if (!score) return std::unexpected(Error("ceiling: " + score.error().message));
      outcome.ceiling = *score;
    }
  }
  std::cout << (a.json ? to_json(outcome) + "\n" : to_text(outcome)) << std::flush;
  return {};
}

void declare(CLI::App& app, Arguments& a) {
  app.add_option("--server", a.server, "HOST:PORT of darmd's TCP port")->required();
  a.tls.declare(app);
  app.add_option("--camera", a.camera, "\"px,py,pz tx,ty,tz fovy_degrees\", or a name of --setup");
  app.add_option("--setup", a.setup,
                 "set-up file with [[cameras]] and [[load_cameras]], e.g. config/scenes/sponza.toml");
  app.add_option("--walkthrough", a.walkthrough,
                 "JSON list of {t, position, target, fovy}; begins at the first full image");
  app.add_option("--size", a.size, "picture, WIDTHxHEIGHT")->capture_default_str();
  app.add_option("--seconds", a.seconds,
                 "stop after so long (default 10, a walkthrough's length; the limit of --until-error: 120)")
      ->check(number_option(0, kLongest));
  app.add_option("--until-error", a.until_error,
                 "stop once the server's estimated RMS display error is at most this, 0..1")
      ->check(number_option(0, 1));
  app.add_option("--target-error", a.target_error,
                 "ask the server to compute until this RMS display error, 0..1; 0: its own target")
      ->check(number_option(0, 1));
  app.add_option("--reference", a.reference, "BASE.pfm with its halves BASE.a.pfm and BASE.b.pfm beside it");
  app.add_option("--ceiling-seconds", a.ceiling_seconds,
                 "then open a lossless session at the same camera for so long and score it as the ceiling")
      ->check(number_option(0, kLongest));
  app.add_option("--ceiling-phystex", a.ceiling_phystex, "PhysTex of that session, pixels")->capture_default_str();
  app.add_option("--ceiling", a.ceiling, "picture of the ceiling: read if it is there, else written")
      ->check(kWritablePlace);
  app.add_flag("--lossless", a.lossless, "stream without codec (the server must allow it)");
  app.add_flag("--no-444", a.no_444, "do not offer 4:4:4 chroma");
  app.add_flag("--no-udp", a.no_udp, "send cameras over TCP, as a browser does");
  app.add_flag("--lag", a.lag,
               "draw every picture that comes and report lag_ms, from a camera to the picture drawn for it, by stage");
  app.add_flag("--check-first-picture", a.check_first,
               "count the samples of the first picture that show no surface (takes a drawing more)");
  app.add_option("--phystex", a.phystex, "largest PhysTex to accept, pixels")->capture_default_str();
  app.add_option(
         "--view-phystex", a.view_phystex,
         "largest PhysTex of the private layer to accept, pixels; 0: only light that does not depend on the eye")
      ->capture_default_str();
  app.add_option("--updates-per-second", a.updates_per_second, "cameras sent, also when still")
      ->capture_default_str()
      ->check(number_option(0.1, 240));
  app.add_option("--series-interval", a.series_interval,
                 "seconds between points of the series (default: 1, 2, 5, 10, 20, 30, 60, ...)")
      ->check(number_option(0, kLongest));
  app.add_flag("--codec-check", a.codec_check,
               "then compare each tile with a lossless session's: PSNR of PhysTex after the codec (a lower bound)");
  app.add_option("--bench-draw", a.bench_draw, "draw so many pictures at the end to measure frames/s");
  app.add_option("--out", a.out, "PNG of the last picture")->check(kWritablePlace);
  app.add_flag("--json", a.json, "report as JSON on standard output");
}

}  // namespace
}  // namespace darm::client::probe

int main(int argc, char** argv) {
  using namespace darm::client::probe;
  CLI::App app("darm-probe: connect to darmd as a client, draw without a window, measure");
  Arguments arguments;
  declare(app, arguments);
  CLI11_PARSE(app, argc, argv);
  if (const auto done = run(arguments); !done) {
    std::cerr << "darm-probe: " << done.error().message << "\n";
    return 1;
  }
  return 0;
}
