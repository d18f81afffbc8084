#include "daemon/daemon.hpp"

#include <spdlog/spdlog.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <optional>
#include <thread>
#include <utility>

#include "actors/encoder/coarse_encoder_actor.hpp"
#include "actors/encoder/encoder_actor.hpp"
#include "actors/renderer/renderer_actor.hpp"
#include "actors/renderer/tile_surface_scene.hpp"
#include "actors/renderer/view_renderer_actor.hpp"
#include "actors/renderer/view_surface_scene.hpp"
#include "actors/runtime/registry.hpp"
#include "actors/runtime/threaded_system.hpp"
#include "actors/session/session_actor.hpp"
#include "actors/session/tcp_listener.hpp"
#include "actors/session/udp_listener.hpp"
#include "actors/tile_scheduler/tile_scheduler_actor.hpp"
#include "daemon/late_ref.hpp"
#include "daemon/observe/prometheus_sink.hpp"
#include "daemon/scene_setup.hpp"
#include "daemon/stream_directory.hpp"
#include "proto/darm.pb.h"

namespace darm {
namespace {

using Sessions = runtime::Registry<SessionId, session::Inbox>;
using Work = boost::asio::executor_work_guard<boost::asio::io_context::executor_type>;

constexpr std::size_t kMailbox = 4096;
constexpr Microseconds kRefineInterval = 300'000;
constexpr auto kGoodbyeTime = std::chrono::milliseconds(1500);

tile_scheduler::SchedulerOptions scheduler_options(const config::Config& config) {
  tile_scheduler::SchedulerOptions options;
  options.updates_per_second = config.stream.updates_per_second;
  options.stream.max_writes = config.stream.max_writes;
  options.stream.refine_interval = kRefineInterval;
  return options;
}

renderer::RendererOptions renderer_options(const config::Config& config, float exposure) {
  renderer::RendererOptions options;
  options.display.exposure = exposure;
  options.display.filter_samples = static_cast<float>(config.accuracy.filter_samples);
  options.schedule.max_samples = config.render.max_samples;
  options.slice_ms = static_cast<float>(config.render.slice_ms);
  return options;
}

renderer::ViewRendererOptions view_options(const config::Config& config, float exposure) {
  renderer::ViewRendererOptions options;
  options.tile.exposure = exposure;
  options.tile.max_samples = static_cast<float>(config.render.max_samples);
  options.slice_ms = static_cast<float>(config.render.slice_ms);
  return options;
}

session::SessionPolicy session_policy(const config::Config& config, const World& world) {
  session::SessionPolicy policy;
  policy.view_phystex = world.view_materials ? config.stream.view_phystex : 0;
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
  policy.send.grace = static_cast<Microseconds>(config.session.send_queue_seconds * 1e6);
  return policy;
}

std::shared_ptr<const tile_scheduler::CoarseLuma> luma_of(const renderer::CoarsePicture& picture) {
  auto out = std::make_shared<tile_scheduler::CoarseLuma>();
  out->width = picture.width;
  out->height = picture.height;
  out->luma.reserve(picture.rgb.size() / 3);
  for (std::size_t i = 0; i + 2 < picture.rgb.size(); i += 3)
    out->luma.push_back(static_cast<std::uint8_t>(
        (13933 * picture.rgb[i] + 46871 * picture.rgb[i + 1] + 4732 * picture.rgb[i + 2] + 32768) >> 16));  // BT.709
  return out;
}

encoder::EncoderOptions encoder_options(const config::Config& config, StreamId stream,
                                        const tile_scheduler::StreamFormat& format) {
  encoder::EncoderOptions options;
  options.stream = stream;
  options.layer = format.layer;
  options.phystex_size = format.phystex_size;
  options.chroma_444 = format.chroma_444;
  options.lossless_rgb = format.lossless_rgb;
  options.crf = static_cast<float>(config.stream.crf);
  options.preset = config.stream.preset;
  options.frames_per_second = static_cast<float>(config.stream.updates_per_second);
  return options;
}

}  // namespace

struct Daemon::Parts {
  config::Config config;
  std::uint64_t seed = 0;
  atlas::StoreCounters reported;  // what report_store() has seen
  observe::PrometheusSink metrics;
  std::optional<observe::Health> health;
  World world;
  std::shared_ptr<Sessions> sessions = std::make_shared<Sessions>();
  std::shared_ptr<StreamDirectory> streams = std::make_shared<StreamDirectory>(sessions);
  std::unique_ptr<runtime::ThreadedSystem> system;
  runtime::Ref<tile_scheduler::Inbox> scheduler;
  runtime::Ref<encoder::CoarseInbox> coarse;
  std::shared_ptr<session::SessionSurroundings> surroundings;
  boost::asio::io_context io;
  std::optional<Work> io_work;
  std::unique_ptr<session::UdpListener> udp;
  std::unique_ptr<session::TcpListener> tcp;
  std::thread io_thread;

  void fill_supervision(const std::function<void(const std::string&)>& on_fatal);
  void spawn_actors();
  [[nodiscard]] tile_scheduler::Peers make_peers(std::shared_ptr<LateRef<renderer::Inbox>> renderer,
                                                 std::shared_ptr<LateRef<renderer::ViewInbox>> view_renderer);
  void spawn_view_renderer(LateRef<renderer::ViewInbox>& ref);
  [[nodiscard]] Result<Addresses> listen();
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

tile_scheduler::Peers Daemon::Parts::make_peers(std::shared_ptr<LateRef<renderer::Inbox>> renderer,
                                                std::shared_ptr<LateRef<renderer::ViewInbox>> view_renderer) {
  tile_scheduler::Peers peers;
  if (world.view_materials) peers.view_renderer = [view_renderer] { return view_renderer->get(); };
  peers.renderer = [renderer] { return renderer->get(); };
  peers.make_encoder = [this](StreamId stream, const tile_scheduler::StreamFormat& format) {
    auto receivers = [streams = streams, stream] { return streams->receivers(stream); };
    return system->spawn<encoder::EncoderActor>("encoder/" + std::to_string(static_cast<std::uint32_t>(stream)), 16,
                                                encoder_options(config, stream, format), std::move(receivers),
                                                scheduler, metrics);
  };
  peers.destroy_encoder = [this](StreamId, const runtime::Ref<encoder::Inbox>& encoder) { system->stop(encoder); };
  peers.set_receivers = [streams = streams](StreamId stream, std::vector<SessionId> receivers) {
    streams->set(stream, std::move(receivers));
  };
  peers.sessions = sessions;
  return peers;
}

// Only where the scene calls for it: else there is no such actor.
void Daemon::Parts::spawn_view_renderer(LateRef<renderer::ViewInbox>& ref) {
  if (!world.view_materials) return;
  renderer::ViewRendererParts parts;
  parts.surfaces = renderer::make_view_surfaces(world.scene, world.mapper, world.transport, seed);
  parts.options = view_options(config, world.exposure);
  parts.scheduler = scheduler;
  parts.metrics = &metrics;
  ref.set(system->spawn<renderer::ViewRendererActor>("view_renderer", 1024, std::move(parts)));
}

void Daemon::Parts::spawn_actors() {
  coarse = system->spawn<encoder::CoarseEncoderActor>("coarse_encoder", 64, sessions, encoder::CoarseStillOptions{},
                                                      metrics);
  auto renderer_ref = std::make_shared<LateRef<renderer::Inbox>>();
  auto view_ref = std::make_shared<LateRef<renderer::ViewInbox>>();
  auto peers = std::make_shared<tile_scheduler::Peers>(make_peers(renderer_ref, view_ref));
  scheduler =
      system->spawn<tile_scheduler::TileSchedulerActor>("tile_scheduler", kMailbox, world.layout, world.rays, peers,
                                                        scheduler_options(config), metrics, world.view_materials);
  spawn_view_renderer(*view_ref);
  renderer::RendererParts parts;
  parts.surfaces = renderer::make_scene_surfaces(world.scene, world.mapper, world.transport, seed);
  parts.store = world.store;
  parts.levels = renderer::level_tiles_of(*world.layout);
  if (config.accuracy.indirect == "stored") parts.layout = world.layout;
  parts.options = renderer_options(config, world.exposure);
  parts.scheduler = scheduler;
  parts.metrics = &metrics;
  parts.coarse = [to = coarse, to_scheduler = scheduler](const std::shared_ptr<const renderer::CoarsePicture>& from) {
    auto picture = std::make_shared<encoder::CoarsePicture>();
    picture->version = from->version;
    picture->width = from->width;
    picture->height = from->height;
    picture->rgb = from->rgb;
    to.tell(encoder::CoarseShaded(std::move(picture)));
    to_scheduler.tell(tile_scheduler::CoarsePictured(luma_of(*from)));
  };
  parts.light = [view_ref](std::shared_ptr<const renderer::StoredLight> light) {
    view_ref->get().tell(renderer::LightStored(std::move(light)));
  };
  renderer_ref->set(system->spawn<renderer::RendererActor>("renderer", 1024, std::move(parts)));
}

Result<Addresses> Daemon::Parts::listen() {
  Addresses addresses;
  addresses.metrics_url = metrics.url();
  surroundings = std::make_shared<session::SessionSurroundings>();
  surroundings->policy = session_policy(config, world);
  surroundings->scene = world.geometry;
  surroundings->scheduler = scheduler;
  surroundings->coarse = coarse;
  surroundings->sessions = sessions;
  surroundings->metrics = &metrics;
  surroundings->log = [](SessionId id, const std::string& text) {
    spdlog::info("session {}: {}", static_cast<std::uint64_t>(id), text);
  };
  auto opened_udp = session::UdpListener::open(io, surroundings, config.listen.address,
                                               static_cast<std::uint16_t>(config.listen.udp_port));
  if (!opened_udp) return std::unexpected(opened_udp.error());
  udp = std::move(*opened_udp);
  session::TcpListenerOptions options;
  options.address = config.listen.address;
  options.port = static_cast<std::uint16_t>(config.listen.tcp_port);
  options.max_sessions = config.session.max_sessions;
  auto opened_tcp = session::TcpListener::open(io, *system, surroundings, options);
  if (!opened_tcp) return std::unexpected(opened_tcp.error());
  tcp = std::move(*opened_tcp);
  addresses.tcp = tcp->port();
  addresses.udp = udp->port();
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

  runtime::ThreadedOptions options;
  options.workers = threads;
  options.metrics = &parts.metrics;
  parts.system = std::make_unique<runtime::ThreadedSystem>(options);
  parts.fill_supervision(on_fatal);
  parts.spawn_actors();
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
        "radiance store: full at {} tiles, so what is newly seen stays coarse; raise state.max_store_bytes, make room "
        "on "
        "the disk, or remove {} while darmd is stopped",
        now.tiles, parts.world.store->path().string());
  if (now.torn > parts.reported.torn)
    spdlog::warn("radiance store: {} damaged tiles refused so far; they are lit anew", now.torn);
  parts.reported = now;
}

bool Daemon::stop(std::chrono::milliseconds deadline) {
  auto& parts = *parts_;
  const auto end = std::chrono::steady_clock::now() + deadline;
  if (parts.health) parts.health->set_ready(false);
  if (parts.tcp) parts.tcp->stop();
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
  parts.udp.reset();
  if (parts.io_thread.joinable()) parts.io_thread.join();  // ends when the last socket is closed
  parts.world.store.reset();
  return true;
}

}  // namespace darm
