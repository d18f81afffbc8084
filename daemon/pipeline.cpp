#include "daemon/pipeline.hpp"

#include <string>
#include <utility>
#include <vector>

#include "actors/encoder/coarse_encoder_actor.hpp"
#include "actors/encoder/encoder_actor.hpp"
#include "actors/renderer/renderer_actor.hpp"
#include "actors/renderer/tile_surface_scene.hpp"
#include "actors/renderer/view_renderer_actor.hpp"
#include "actors/renderer/view_surface_scene.hpp"
#include "actors/tile_scheduler/tile_scheduler_actor.hpp"
#include "daemon/freed_memory.hpp"
#include "daemon/late_ref.hpp"

namespace darm {
namespace {

constexpr std::size_t kMailbox = 4096;
constexpr Microseconds kRefineInterval = 300'000;

tile_scheduler::SchedulerOptions scheduler_options(const config::Config& config) {
  tile_scheduler::SchedulerOptions options;
  options.updates_per_second = config.stream.updates_per_second;
  options.stream.max_writes = config.stream.max_writes;
  options.stream.refine_interval = kRefineInterval;
  options.groups.share = config.stream.share;
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

std::shared_ptr<const tile_scheduler::CoarseLuma> luma_of(const renderer::CoarsePicture& picture) {
  auto out = std::make_shared<tile_scheduler::CoarseLuma>();
  out->width = picture.width;
  out->height = picture.height;
  out->luma.reserve(picture.rgb.size() / 3);
  for (std::size_t i = 0; i + 2 < picture.rgb.size(); i += 3)
    out->luma.push_back(static_cast<std::uint8_t>(
        (13933 * picture.rgb[i] + 46871 * picture.rgb[i + 1] + 4732 * picture.rgb[i + 2] + 32768) >> 16));  // BT.709
  out->errors = picture.errors;
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
  options.crf_finest = static_cast<float>(config.stream.crf_finest);
  options.preset = config.stream.preset;
  options.frames_per_second = static_cast<float>(config.stream.updates_per_second);
  return options;
}

// What the steps of spawn_pipeline() share.
struct Wiring {
  runtime::System& system;
  const World& world;
  const config::Config& config;
  PipelineParts parts;
  Pipeline made;
  std::shared_ptr<LateRef<tile_scheduler::Inbox>> scheduler = std::make_shared<LateRef<tile_scheduler::Inbox>>();
  std::shared_ptr<LateRef<renderer::Inbox>> renderer = std::make_shared<LateRef<renderer::Inbox>>();
  std::shared_ptr<LateRef<renderer::ViewInbox>> view_renderer = std::make_shared<LateRef<renderer::ViewInbox>>();
};

tile_scheduler::Peers make_peers(const Wiring& w) {
  tile_scheduler::Peers peers;
  if (w.world.has_view_layer()) peers.view_renderer = [ref = w.view_renderer] { return ref->get(); };
  peers.renderer = [ref = w.renderer] { return ref->get(); };
  const auto streams = std::make_shared<StreamDirectory>(w.parts.sessions);
  peers.make_encoder = [&system = w.system, &metrics = *w.parts.metrics, config = w.config, scheduler = w.scheduler,
                        streams,
                        before = w.parts.before_encoder](StreamId stream, const tile_scheduler::StreamFormat& format) {
    auto receivers = [streams, stream] { return streams->receivers(stream); };
    auto encoder = system.spawn<encoder::EncoderActor>("encoder/" + std::to_string(static_cast<std::uint32_t>(stream)),
                                                       16, encoder_options(config, stream, format),
                                                       std::move(receivers), scheduler->get(), metrics);
    return before ? before(format, encoder) : encoder;
  };
  peers.destroy_encoder = [&system = w.system, freed = std::make_shared<FreedMemory>()](
                              StreamId, const runtime::Ref<encoder::Inbox>& encoder) {
    system.stop(encoder);
    freed->give_back_soon(system.executor());
  };
  peers.set_receivers = [streams](StreamId stream, std::vector<SessionId> receivers) {
    streams->set(stream, std::move(receivers));
  };
  peers.sessions = w.parts.sessions;
  return peers;
}

void spawn_scheduler(Wiring& w) {
  auto peers = std::make_shared<tile_scheduler::Peers>(make_peers(w));
  w.made.scheduler = w.system.spawn<tile_scheduler::TileSchedulerActor>(
      "tile_scheduler", kMailbox, w.world.layout, w.world.rays, peers, scheduler_options(w.config), *w.parts.metrics,
      w.world.view_materials);
  w.scheduler->set(w.made.scheduler);
}

// Only where the scene calls for it: else there is no such actor.
void spawn_view_renderer(const Wiring& w) {
  if (!w.world.has_view_layer()) return;
  renderer::ViewRendererParts parts;
  parts.surfaces = renderer::make_view_surfaces(w.world.scene, w.world.mapper, w.world.transport, w.parts.seed);
  parts.options = view_options(w.config, w.world.exposure);
  parts.scheduler = w.made.scheduler;
  parts.metrics = w.parts.metrics;
  w.view_renderer->set(w.system.spawn<renderer::ViewRendererActor>("view_renderer", 1024, std::move(parts)));
}

void spawn_renderer(const Wiring& w) {
  renderer::RendererParts parts;
  parts.surfaces = renderer::make_scene_surfaces(w.world.scene, w.world.mapper, w.world.transport, w.parts.seed);
  parts.store = w.world.store;
  parts.levels = renderer::level_tiles_of(*w.world.layout);
  if (w.config.accuracy.indirect == "stored") parts.layout = w.world.layout;
  parts.options = renderer_options(w.config, w.world.exposure);
  parts.scheduler = w.made.scheduler;
  parts.metrics = w.parts.metrics;
  parts.coarse = [to = w.made.coarse,
                  to_scheduler = w.made.scheduler](const std::shared_ptr<const renderer::CoarsePicture>& from) {
    auto picture = std::make_shared<encoder::CoarsePicture>();
    picture->version = from->version;
    picture->width = from->width;
    picture->height = from->height;
    picture->rgb = from->rgb;
    to.tell(encoder::CoarseShaded(std::move(picture)));
    to_scheduler.tell(tile_scheduler::CoarsePictured(luma_of(*from)));
  };
  parts.light = [ref = w.view_renderer](std::shared_ptr<const renderer::StoredLight> light) {
    ref->get().tell(renderer::LightStored(std::move(light)));
  };
  w.renderer->set(w.system.spawn<renderer::RendererActor>("renderer", 1024, std::move(parts)));
}

}  // namespace

Pipeline spawn_pipeline(runtime::System& system, const World& world, const config::Config& config,
                        PipelineParts parts) {
  Wiring w{system, world, config, std::move(parts), {}};
  w.made.coarse = system.spawn<encoder::CoarseEncoderActor>("coarse_encoder", 64, w.parts.sessions,
                                                            encoder::CoarseStillOptions{}, *w.parts.metrics);
  spawn_scheduler(w);
  spawn_view_renderer(w);
  spawn_renderer(w);
  return w.made;
}

}  // namespace darm
