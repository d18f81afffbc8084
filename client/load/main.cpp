// darm-load: many simulated clients at once, each of which checks what it is sent.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <string>

#include "client/core/camera_path.hpp"
#include "client/core/connection.hpp"
#include "client/core/number_option.hpp"
#include "client/load/load_report.hpp"
#include "client/load/load_run.hpp"
#include "client/load/plot.hpp"
#include "client/load/process_usage.hpp"

namespace darm::client::load {
namespace {

constexpr double kLongest = 1e6;  // seconds
constexpr unsigned kMostClients = 10'000;

struct Arguments {
  std::string server, setup, walkthrough, plot;
  LoadPlan plan;
  bool groups = false, no_udp = false, json = false;
  double rate_mbit = 0, round_trip_ms = 0;
};

Result<void> read_paths(Arguments& a) {
  if (a.groups && a.setup.empty()) return fail("--groups: needs --setup FILE, where the groups are");
  if (!a.walkthrough.empty()) {
    auto path = read_walkthrough(a.walkthrough);
    if (!path) return std::unexpected(path.error());
    a.plan.walkthrough = std::move(*path);
  }
  if (a.setup.empty() || (!a.groups && !a.walkthrough.empty())) return {};
  auto places = a.groups ? read_load_groups(a.setup) : read_load_cameras(a.setup);
  if (!places) return std::unexpected(places.error());
  a.plan.places = std::move(*places);
  return {};
}

// A sentence for each thing that makes a run no success; the figures are printed all the same.
bool complain(const LoadReport& report) {
  bool good = true;
  const auto say = [&](const std::string& sentence) {
    std::cerr << "darm-load: " << sentence << "\n";
    good = false;
  };
  if (report.all.connected < report.all.clients)
    say(std::to_string(report.all.clients - report.all.connected) + " of " + std::to_string(report.all.clients) +
        " clients were not welcomed or were cut off");
  if (!report.all_ready) say("not every client had its first frame before counting began");
  if (report.disconnects.contains("SERVER_FULL"))
    say("the server takes no more clients: raise max_sessions, max_sessions_per_address or max_memory_bytes under "
        "[session] in its configuration (darm_session_events_total says which)");
  if (report.all.faults.total() > 0) say(std::to_string(report.all.faults.total()) + " faults in what the server sent");
  return good;
}

Result<bool> run(Arguments& a) {
  if (auto ok = parse_address(a.server, a.plan.host, a.plan.port); !ok) return std::unexpected(ok.error());
  if (auto ok = read_paths(a); !ok) return std::unexpected(ok.error());
  a.plan.machine.udp = !a.no_udp;
  a.plan.link.bytes_per_second = a.rate_mbit * 1e6 / 8;
  a.plan.link.delay_ms = a.round_trip_ms / 2;
  if (const auto warning = descriptor_warning(raise_descriptor_limit(), a.plan.crowd.clients); !warning.empty())
    return fail(warning);
  const auto report = run_load(a.plan);
  if (!report) return std::unexpected(report.error());
  if (!a.plot.empty()) {
    std::ofstream out(a.plot);
    out << plot(*report);
    if (!out.flush()) return fail("--plot " + a.plot + ": cannot be written");
  }
  std::cout << (a.json ? to_json(*report) + "\n" : to_text(*report)) << std::flush;
  return complain(*report);
}

void declare_crowd(CLI::App& app, LoadPlan& plan) {
  CrowdShape& crowd = plan.crowd;
  app.add_option("--clients", crowd.clients, "clients at once")->required()->check(CLI::Range(1u, kMostClients));
  app.add_option("--draw", crowd.draw, "of these, decode and draw once a second")->check(CLI::Range(0u, 16u));
  app.add_option("--decode", crowd.decode, "of these, decode every frame; the others check what they are sent")
      ->check(CLI::Range(0u, kMostClients));
  app.add_option("--slow", crowd.slow, "of these, read --slow-rate bytes a second")
      ->check(CLI::Range(0u, kMostClients));
  app.add_option("--slow-rate", plan.slow_bytes_per_second, "bytes a second")
      ->capture_default_str()
      ->check(number_option(1, 1e12));
  app.add_option("--vanish", crowd.vanish, "of these, are gone without a word in the first half of the time")
      ->check(CLI::Range(0u, kMostClients));
  app.add_option("--teleport", crowd.teleport, "of these, look from somewhere else every second")
      ->check(CLI::Range(0u, kMostClients));
  app.add_option("--stall", crowd.stall, "of these, the first: their lines stand for --stall-seconds, half-way")
      ->check(CLI::Range(0u, kMostClients));
  app.add_option("--stall-seconds", plan.stall_seconds, "that they stand")
      ->capture_default_str()
      ->check(number_option(0.1, kLongest));
  app.add_option("--churn", plan.crowd.churn, "joins a second, and as many leaves")->check(number_option(0, 1000));
  app.add_option("--spread", crowd.spread, "metres around its group's place in which each client is")
      ->capture_default_str()
      ->check(number_option(0, 1e6));
  app.add_option("--seed", crowd.seed, "of all chance")->capture_default_str();
}

void declare(CLI::App& app, Arguments& a) {
  LoadPlan& plan = a.plan;
  app.add_option("server,--server", a.server, "HOST:PORT of darmd's TCP port")->required();
  declare_crowd(app, plan);
  app.add_option("--seconds", plan.seconds, "counted, from when all clients have their first frame")
      ->capture_default_str()
      ->check(number_option(0.1, kLongest));
  app.add_option("--warm-up", plan.warm_up, "seconds after which counting begins whoever is there")
      ->capture_default_str()
      ->check(number_option(0.1, kLongest));
  app.add_option("--settle", plan.settle, "seconds to watch the server's memory after all have left")
      ->check(number_option(0, kLongest));
  app.add_option("--connects-per-second", plan.connects_per_second, "at the start")
      ->capture_default_str()
      ->check(number_option(0.1, 10'000));
  app.add_option("--setup", a.setup, "set-up file; clients stand at its [[load_cameras]], or with --groups:");
  app.add_flag("--groups", a.groups, "at its [[load_groups]]");
  app.add_option(
      "--walkthrough", a.walkthrough,
      "JSON list of {t, position, target, fovy}, walked to and fro; groups begin where it passes their place");
  app.add_option("--width", plan.machine.width, "of each view, pixels")
      ->capture_default_str()
      ->check(CLI::Range(1u, 8192u));
  app.add_option("--height", plan.machine.height, "of each view, pixels")
      ->capture_default_str()
      ->check(CLI::Range(1u, 8192u));
  app.add_option("--draw-height", plan.draw_height, "of pictures that are drawn, at most, pixels")
      ->capture_default_str()
      ->check(CLI::Range(1u, 8192u));
  app.add_option("--phystex", plan.machine.max_phystex, "largest PhysTex to accept, pixels")->capture_default_str();
  app.add_option("--view-phystex", plan.machine.max_view_phystex, "the same of the private layer; 0: none")
      ->capture_default_str();
  app.add_flag("--no-udp", a.no_udp, "send cameras over TCP, as a browser does");
  app.add_option("--delay-ms", a.round_trip_ms, "emulate a line: there and back")->check(number_option(0, 60'000));
  app.add_option("--rate-mbit", a.rate_mbit, "emulate a line: Mbit/s to each client")->check(number_option(0, 1e6));
  app.add_option("--loss", plan.link.loss, "emulate a line: share of packets lost, 0..1")->check(number_option(0, 1));
  app.add_option("--server-pid", plan.server_pid, "of darmd, here: its processor time and memory are reported")
      ->check(CLI::Range(1, 1 << 30));
  app.add_option("--plot", a.plot, "SVG of the run");
  app.add_flag("--json", a.json, "report as JSON on standard output");
}

}  // namespace
}  // namespace darm::client::load

int main(int argc, char** argv) {
  using namespace darm::client::load;
  CLI::App app("darm-load: many simulated clients that check what darmd sends them");
  Arguments arguments;
  declare(app, arguments);
  CLI11_PARSE(app, argc, argv);
  const auto good = run(arguments);
  if (!good) {
    std::cerr << "darm-load: " << good.error().message << "\n";
    return 1;
  }
  return *good ? 0 : 1;
}
