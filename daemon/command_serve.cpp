// darmd serve: runs the daemon until it is told to stop.
#include <spdlog/spdlog.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string>

#include "daemon/commands.hpp"
#include "daemon/daemon.hpp"
#include "daemon/lifecycle/service_notifier.hpp"
#include "daemon/lifecycle/stop_count.hpp"
#include "daemon/lifecycle/stop_deadline.hpp"
#include "daemon/lifecycle/stop_signals.hpp"
#include "daemon/observe/log.hpp"

namespace darm {
namespace {

using namespace std::chrono_literals;
constexpr auto kStopTime = 8s;

/// Where the main thread waits for a reason to stop.
class StopRequest {
 public:
  void ask(std::string why, bool failed) {
    const std::lock_guard lock(mutex_);
    if (asked_) return;
    asked_ = true;
    failed_ = failed;
    why_ = std::move(why);
    changed_.notify_all();
  }
  /// Waits; `alive` is called every `interval`. Returns the reason.
  std::string wait(std::chrono::microseconds interval, const std::function<void()>& alive) {
    std::unique_lock lock(mutex_);
    while (!changed_.wait_for(lock, interval, [this] { return asked_; })) alive();
    return why_;
  }
  [[nodiscard]] bool failed() {
    const std::lock_guard lock(mutex_);
    return failed_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool asked_ = false;
  bool failed_ = false;
  std::string why_;
};

std::string ready_line(const config::Config& config, const Addresses& at) {
  const auto& address = config.listen.address;
  const std::string host = address.find(':') == std::string::npos ? address : "[" + address + "]";
  std::string line = "ready: tcp " + host + ":" + std::to_string(at.tcp) + ", udp port " + std::to_string(at.udp);
  if (!at.metrics_url.empty()) line += ", metrics " + at.metrics_url;
  const bool everywhere = address == "0.0.0.0" || address == "::";
  if (at.web != 0) line += ", web http://" + (everywhere ? "localhost" : host) + ":" + std::to_string(at.web) + "/";
  if (at.web != 0 && !at.tls_fingerprint.empty()) line += " and https on the same port";
  return line;
}

// What a person needs to compare when the browser says that it does not know the certificate.
void tell_certificate(const Addresses& at) {
  if (at.tls_fingerprint.empty()) return;
  spdlog::info(
      "tls: the certificate is {}; its SHA-256 fingerprint is {}",
      at.certificate_is_ours ? "this server's own, so browsers ask before they trust it" : "the configured one",
      at.tls_fingerprint);
}

}  // namespace

int run(const ServeCommand& command) {
  const auto notifier = lifecycle::ServiceNotifier::from_environment();
  StopRequest stop;
  const lifecycle::StopSignals signals([&stop, count = lifecycle::StopCount()](int number) mutable {
    const auto wish = count.signal(std::chrono::steady_clock::now());
    if (wish == lifecycle::StopCount::Wish::kLeave) std::_Exit(lifecycle::kInterrupted);
    if (wish == lifecycle::StopCount::Wish::kStop) stop.ask(number == 2 ? "interrupted" : "asked to stop", false);
  });
  observe::set_up_log(command.config.log.level, command.config.log.json);

  auto daemon = std::make_unique<Daemon>(command.config, command.seed);
  const auto start = std::chrono::steady_clock::now();
  const auto addresses = daemon->start([&stop](const std::string& why) { stop.ask(why, true); });
  if (!addresses) {
    std::fprintf(stderr, "darmd serve: %s\n", addresses.error().message.c_str());
    static_cast<void>(daemon->stop(1s));
    return 1;
  }
  const std::string line = ready_line(command.config, *addresses);
  std::printf("darmd %s (%.2f s)\n", line.c_str(),
              std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  std::fflush(stdout);
  tell_certificate(*addresses);
  notifier.ready(line);

  const auto interval = notifier.watchdog_interval().value_or(1s);
  const std::string why = stop.wait(interval, [&] {
    notifier.watchdog();
    daemon->report_store();
    daemon->report_effects();
  });
  if (stop.failed()) {
    spdlog::error("stopping: {}", why);
  } else {
    spdlog::info("stopping: {}", why);
  }
  notifier.stopping();
  const lifecycle::StopDeadline deadline(kStopTime + 2s, [] { spdlog::error("stop: past the deadline"); });
  if (!daemon->stop(kStopTime)) std::_Exit(1);
  daemon.reset();  // the metrics too, before the deadline: when "stopped" is said the process is as good as gone
  spdlog::info("stopped");
  return stop.failed() ? 1 : 0;
}

}  // namespace darm
