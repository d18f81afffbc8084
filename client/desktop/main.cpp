// darm-view: a window into a scene that darmd lights.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <csignal>
#include <iostream>
#include <map>

#include "client/core/number_option.hpp"
#include "client/core/tls_options.hpp"
#include "client/desktop/view_link.hpp"
#include "client/desktop/viewer.hpp"

namespace darm::client::desktop {
namespace {

constexpr int kLargestSide = 8192;
constexpr double kLongest = 1e7;  // seconds

struct Arguments {
  std::string server, camera, size = "1280x720", screenshot, report;
  TlsOptions tls;
  double after = -1, turn = 0;
  bool panel = false, bare = false, no_vsync = false, finest = false;
  GlKind gl = GlKind::kAuto;
};

Result<void> read_size(const std::string& text, WindowPlan& plan) {
  const char* last = text.data() + text.size();
  const auto w = std::from_chars(text.data(), last, plan.width);
  const bool wide = w.ec == std::errc() && w.ptr != last && *w.ptr == 'x';
  const auto h = wide ? std::from_chars(w.ptr + 1, last, plan.height) : w;
  const auto fits = [](int side) { return side >= 1 && side <= kLargestSide; };
  if (wide && h.ec == std::errc() && h.ptr == last && fits(plan.width) && fits(plan.height)) return {};
  return fail(fmt::format("--size {}: expected WIDTHxHEIGHT, 1 to {} each", text, kLargestSide));
}

Result<VisitPlan> make_plan(const Arguments& a) {
  VisitPlan plan;
  plan.server.name = "darm-view 0.1.0";
  if (auto ok = parse_address(a.server, plan.server.host, plan.server.port); !ok) return std::unexpected(ok.error());
  plan.server.tls = a.tls.wanted();
  plan.server.authority = a.tls.authority;
  if (auto ok = read_size(a.size, plan.window); !ok) return std::unexpected(ok.error());
  plan.window.title = "DARM - " + a.server;
  plan.window.gl = a.gl;
  plan.window.vsync = !a.no_vsync;
  plan.finest = a.finest;
  if (!a.camera.empty()) {
    const auto view = read_view(a.camera);
    if (!view) return std::unexpected(view.error());
    plan.view = *view;
  }
  plan.panel = a.panel;
  plan.bare = a.bare;
  plan.turn = a.turn;
  if (a.after >= 0) plan.seconds = a.after;
  if (!a.screenshot.empty() && !plan.seconds) return fail("--screenshot: --after SECONDS is needed with it");
  plan.screenshot = a.screenshot;
  plan.report = a.report;
  return plan;
}

void declare(CLI::App& app, Arguments& a) {
  app.add_option("server", a.server, "HOST:PORT of darmd's TCP port")->required();
  app.add_option("--camera", a.camera,
                 "where to begin: \"px,py,pz tx,ty,tz fovy_degrees\", or a link to a view (#view=...)");
  app.add_option("--size", a.size, "inside of the window, WIDTHxHEIGHT")->capture_default_str();
  a.tls.declare(app);
  app.add_flag("--panel", a.panel, "show the measurements from the start");
  app.add_flag("--bare", a.bare, "show nothing but the scene");
  app.add_option("--turn", a.turn, "degrees a second by which the view turns by itself")
      ->check(number_option(-360, 360));
  app.add_option("--after", a.after, "leave after so many seconds")->check(number_option(0, kLongest));
  app.add_option("--screenshot", a.screenshot, "with --after: PNG of the scene, written on leaving");
  app.add_option("--report", a.report, "JSON of frames a second and times, written on leaving; -: standard output");
  app.add_flag("--finest", a.finest, "never draw coarser to keep up with the hand");
  app.add_flag("--no-vsync", a.no_vsync, "draw as fast as it goes, to measure");
  app.add_option("--gl", a.gl, "what to draw with: auto, es (OpenGL ES 3), desktop (OpenGL 3.3)")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, GlKind>{{"auto", GlKind::kAuto}, {"es", GlKind::kEs}, {"desktop", GlKind::kDesktop}}));
  app.footer(
      "W A S D and arrows walk, Q and E go down and up, R and F look up and down, Shift hurries, dragging looks "
      "around;\n"
      "O changes to orbiting, P shows measurements, H hides all but the scene, L copies a link, F12 saves a picture,\n"
      "F11 fills the screen, F1 or ? shows these keys, Ctrl Q leaves. A gamepad's left stick walks, its right stick "
      "looks.\n");
}

}  // namespace
}  // namespace darm::client::desktop

int main(int argc, char** argv) {
  using namespace darm::client::desktop;
  std::signal(SIGPIPE, SIG_IGN);
  CLI::App app("darm-view: a window into a scene that darmd lights");
  Arguments arguments;
  declare(app, arguments);
  CLI11_PARSE(app, argc, argv);
  const auto plan = make_plan(arguments);
  auto done = plan ? visit(*plan) : std::unexpected(plan.error());
  if (!done) {
    std::cerr << "darm-view: " << done.error().message << "\n";
    return 1;
  }
  return 0;
}
