#include "daemon/daemon.hpp"

#include <spdlog/spdlog.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <optional>
#include <thread>
#include <utility>

#include "actors/runtime/threaded_system.hpp"
#include "actors/session/session_actor.hpp"
#include "actors/session/tcp_listener.hpp"
#include "actors/session/tls_context.hpp"
#include "actors/session/udp_listener.hpp"
#include "actors/session/web_listener.hpp"
#include "daemon/effect_metrics.hpp"
#include "daemon/observe/process_stats.hpp"
#include "daemon/observe/prometheus_sink.hpp"
#include "daemon/pipeline.hpp"
#include "daemon/scene_setup.hpp"
#include "daemon/stream_directory.hpp"
#include "daemon/web_client.hpp"
#include "proto/darm.pb.h"

namespace darm {
namespace {

using Work = boost::asio::executor_work_guard<boost::asio::io_context::executor_type>;

constexpr auto kGoodbyeTime = std::chrono::milliseconds(1500);

session::SessionPolicy session_policy(const config::Config& config, const World& world) {
  session::SessionPolicy policy;
  policy.view_phystex = world.has_view_layer() ? config.stream.view_phystex : 0;
  policy.phystex_size = config.stream.phystex;
  policy.allow_chroma_444 = config.stream.chroma_444;
  policy.allow_lossless = config.stream.allow_lossless;
  policy.updates_per_second = static_cast<float>(config.stream.updates_per_second);
  policy.target_error = static_cast<float>(config.accuracy.target);
  policy.least_target_error = static_cast<float>(std::min(config.accuracy.client_target_min, config.accuracy.target));
  policy.start = start_camera(config, *world.scene);
  policy.handshake_timeout = static_cast<Microseconds>(config.session.handshake_timeout_s * 1e6);
  policy.idle_timeout = static_cast<Microseconds>(config.session.idle_timeout_s * 1e6);
  policy.send.media_bytes = config.session.send_queue_bytes;
  policy.memory = std::make_shared<session::SessionMemory>(config.session.max_memory_bytes);
  policy.send.grace = static_cast<Microseconds>(config.session.send_queue_seconds * 1e6);
  return policy;
}

// Said at the start: when they run out, clients hang and nothing else tells why.
void warn_of_descriptors(std::uint32_t max_sessions) {
  constexpr std::uint64_t kOthers = 64;  // listeners, files, who asks for the page and the metrics
  const std::uint64_t wanted = 2 * std::uint64_t{max_sessions} + kOthers;
  const std::uint64_t allowed = observe::process_stats().most_descriptors;
  if (allowed > 0 && allowed < wanted)
    spdlog::warn(
        "{} file descriptors are allowed, and {} clients (session.max_sessions) may need {}: raise them (ulimit -n, "
        "LimitNOFILE=), or allow fewer clients",
        allowed, max_sessions, wanted);
}

}  // namespace

struct Daemon::Parts {
  config::Config config;
  std::uint64_t seed = 0;
  atlas::StoreCounters reported;  // what report_store() has seen
  observe::PrometheusSink metrics;
  std::optional<observe::Health> health;
  std::optional<EffectMetrics> effects;
  World world;
  std::shared_ptr<StreamDirectory::Sessions> sessions = std::make_shared<StreamDirectory::Sessions>();
  std::unique_ptr<runtime::ThreadedSystem> system;
  Pipeline pipeline;
  std::shared_ptr<session::SessionSurroundings> surroundings;
  boost::asio::io_context io;
  std::optional<Work> io_work;
  std::unique_ptr<session::UdpListener> udp;
  std::unique_ptr<session::TcpListener> tcp;
  std::unique_ptr<session::WebListener> web;
  std::thread io_thread;

  void fill_supervision(const std::function<void(const std::string&)>& on_fatal);
  [[nodiscard]] Result<Addresses> listen();
  [[nodiscard]] Result<void> listen_to_clients(Addresses& addresses);
};

Daemon::Daemon(const config::Config& config, std::uint64_t seed) : parts_(std::make_unique<Parts>()) {
  parts_->config = config;
  parts_->seed = seed;
}

Daemon::~Daemon() = default;

void Daemon::Parts::fill_supervision(const std::function<void(const std::string&)>& on_fatal) {
  using runtime::Failure;
  using runtime::FailureAction;
  const auto log = [](const Failure& failure) {
    spdlog::error("{} failed at {}: {}", failure.actor, failure.message, failure.what);
  };
  auto& table = system->supervisor();
  table.set("session", {FailureAction::kStopActor, log});  // that client only
  table.set("encoder", {FailureAction::kStopActor, log});  // the scheduler makes another: key frame
  table.set("coarse_encoder", {FailureAction::kEscalate, log});
  table.set("renderer", {FailureAction::kEscalate, log});  // slices fail inside it: retry, then quarantine
  table.set("view_renderer", {FailureAction::kEscalate, log});
  table.set("tile_scheduler", {FailureAction::kEscalate, log});
  table.set("pool", {FailureAction::kStopActor, log});
  table.on_escalate([on_fatal](const Failure& failure) { on_fatal(failure.actor + ": " + failure.what); });
}

// The ports that clients connect to: bare TCP and the web, both with and without TLS.
Result<void> Daemon::Parts::listen_to_clients(Addresses& addresses) {
  session::TcpListenerOptions options;
  options.address = config.listen.address;
  options.port = static_cast<std::uint16_t>(config.listen.tcp_port);
  options.max_sessions = config.session.max_sessions;
  if (config.tls.enabled) {
    session::TlsFiles files{config.tls.certificate, config.tls.key};
    addresses.certificate_is_ours = files.certificate.empty();
    if (addresses.certificate_is_ours) {
      auto made = session::self_signed_in(config.state.dir / "tls", config.tls.names);
      if (!made) return std::unexpected(made.error());
      files = std::move(*made);
    }
    auto context = session::make_tls_context(files);
    if (!context) return std::unexpected(context.error());
    options.tls = std::move(*context);
    auto print = session::fingerprint(files.certificate);
    if (!print) return std::unexpected(print.error());
    addresses.tls_fingerprint = std::move(*print);
  }
  auto opened_tcp = session::TcpListener::open(io, *system, surroundings, options);
  if (!opened_tcp) return std::unexpected(opened_tcp.error());
  tcp = std::move(*opened_tcp);
  addresses.tcp = tcp->port();
  if (config.listen.http_port < 0) return {};
  session::WebListenerOptions web_options;
  web_options.address = config.listen.address;
  web_options.port = static_cast<std::uint16_t>(config.listen.http_port);
  web_options.max_sessions = config.session.max_sessions;
  web_options.origins = config.web.origins;
  web_options.files = web_client_files();
  web_options.tls = options.tls;
  auto opened_web = session::WebListener::open(io, *system, surroundings, std::move(web_options));
  if (!opened_web) return std::unexpected(opened_web.error());
  web = std::move(*opened_web);
  addresses.web = web->port();
  return {};
}

Result<Addresses> Daemon::Parts::listen() {
  Addresses addresses;
  addresses.metrics_url = metrics.url();
  surroundings = std::make_shared<session::SessionSurroundings>();
  surroundings->policy = session_policy(config, world);
  surroundings->scene = world.geometry;
  surroundings->scheduler = pipeline.scheduler;
  surroundings->coarse = pipeline.coarse;
  surroundings->sessions = sessions;
  surroundings->addresses = std::make_shared<session::AddressPlaces>(config.session.max_sessions_per_address);
  surroundings->metrics = &metrics;
  surroundings->log = [](SessionId id, const std::string& text) {
    spdlog::info("session {}: {}", static_cast<std::uint64_t>(id), text);
  };
  auto opened_udp = session::UdpListener::open(io, surroundings, config.listen.address,
                                               static_cast<std::uint16_t>(config.listen.udp_port));
  if (!opened_udp) return std::unexpected(opened_udp.error());
  udp = std::move(*opened_udp);
  addresses.udp = udp->port();
  if (auto ok = listen_to_clients(addresses); !ok) return std::unexpected(ok.error());
  io_work.emplace(io.get_executor());
  io_thread = std::thread([this] { io.run(); });
  return addresses;
}

Result<Addresses> Daemon::start(const std::function<void(const std::string&)>& on_fatal) {
  auto& parts = *parts_;
  parts.health.emplace(parts.metrics, "0.1.0");
  if (parts.config.listen.metrics_port >= 0) {
    const auto port = static_cast<std::uint16_t>(parts.config.listen.metrics_port);
    if (auto exposed = parts.metrics.expose(parts.config.listen.address, port); !exposed) {
      return std::unexpected(exposed.error());
    }
  }
  const unsigned threads = thread_count(parts.config);
  auto world = build_world(parts.config, threads);
  if (!world) return std::unexpected(world.error());
  parts.world = std::move(*world);
  parts.effects.emplace(parts.metrics, parts.world.transport->plan());

  runtime::ThreadedOptions options;
  options.workers = threads;
  options.metrics = &parts.metrics;
  parts.system = std::make_unique<runtime::ThreadedSystem>(options);
  parts.fill_supervision(on_fatal);
  parts.pipeline =
      spawn_pipeline(*parts.system, parts.world, parts.config, {parts.seed, parts.sessions, &parts.metrics, {}});
  warn_of_descriptors(parts.config.session.max_sessions);
  auto addresses = parts.listen();
  if (addresses) parts.health->set_ready(true);
  return addresses;
}

void Daemon::report_store() {
  auto& parts = *parts_;
  if (!parts.world.store) return;
  const auto now = parts.world.store->counters();
  if (now.refused_full > 0 && parts.reported.refused_full == 0)
    spdlog::warn(
        "radiance store: full at {} tiles, so what is newly seen stays coarse; raise state.max_store_bytes, make "
        "room on the disk, or remove {} while darmd is stopped",
        now.tiles, parts.world.store->path().string());
  if (now.torn > parts.reported.torn)
    spdlog::warn("radiance store: {} damaged tiles refused so far; they are lit anew", now.torn);
  parts.reported = now;
}

void Daemon::report_effects() {
  if (parts_->effects) parts_->effects->report();
}

bool Daemon::stop(std::chrono::milliseconds deadline) {
  auto& parts = *parts_;
  const auto end = std::chrono::steady_clock::now() + deadline;
  if (parts.health) parts.health->set_ready(false);
  if (parts.tcp) parts.tcp->stop();
  if (parts.web) parts.web->stop();
  parts.sessions->for_each([](SessionId, const auto& ref) {
    ref.tell(session::CloseSession(static_cast<std::uint32_t>(wire::Goodbye::SERVER_STOPS)));
  });
  const auto goodbye_end = std::chrono::steady_clock::now() + std::min(kGoodbyeTime, deadline / 2);
  while (parts.sessions->size() > 0 && std::chrono::steady_clock::now() < goodbye_end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  if (parts.udp) parts.udp->stop();
  if (parts.system) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    const auto late = parts.system->shutdown(std::max(left, std::chrono::milliseconds(100)));
    for (const auto& name : late) spdlog::error("stop: {} is late", name);
    if (!late.empty()) return false;
  }
  parts.io_work.reset();
  parts.tcp.reset();
  parts.web.reset();
  parts.udp.reset();
  if (parts.io_thread.joinable()) parts.io_thread.join();  // ends when the last socket is closed
  parts.world.store.reset();
  return true;
}

}  // namespace darm
