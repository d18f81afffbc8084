// The actors between a camera and an encoded frame, wired to each other.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "actors/encoder/encoder_messages.hpp"
#include "actors/runtime/metrics.hpp"
#include "actors/runtime/system.hpp"
#include "actors/tile_scheduler/tile_scheduler_messages.hpp"
#include "daemon/config/config.hpp"
#include "daemon/stream_directory.hpp"
#include "daemon/world.hpp"

namespace darm {

/// Where cameras go in. What comes out goes to the sessions of PipelineParts.
struct Pipeline {
  runtime::Ref<tile_scheduler::Inbox> scheduler;
  runtime::Ref<encoder::CoarseInbox> coarse;
};

struct PipelineParts {
  std::uint64_t seed = 0;  ///< of the light's sample sequences
  std::shared_ptr<StreamDirectory::Sessions> sessions;
  runtime::MetricSink* metrics = nullptr;  ///< must outlive the system
  /// Puts something between the scheduler and a stream's encoder: what it returns gets the commands in its stead.
  /// Called on the scheduler's turn. Empty: nothing.
  std::function<runtime::Ref<encoder::Inbox>(const tile_scheduler::StreamFormat&, const runtime::Ref<encoder::Inbox>&)>
      before_encoder;
};

/// Spawns tile scheduler, renderer, encoders (one per stream, as sessions come) and, where the scene calls for it, the
/// view renderer. `system` must outlive its actors; `world.store` is the renderer's alone until the system has shut
/// down.
[[nodiscard]] Pipeline spawn_pipeline(runtime::System& system, const World& world, const config::Config& config,
                                      PipelineParts parts);

}  // namespace darm
