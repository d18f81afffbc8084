// A tile scheduler between neighbours that write down what they hear, on the deterministic runtime.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "actors/runtime/deterministic_system.hpp"
#include "actors/tile_scheduler/tile_scheduler_actor.hpp"
#include "tests/unit/tile_scheduler/quad_scene.hpp"

namespace darm::tile_scheduler {

using namespace std::chrono_literals;

// What the neighbours heard; outlives the actors.
struct Heard {
  std::vector<renderer::ShadeTiles> work;
  std::map<StreamId, std::vector<encoder::ComposeFrame>> frames;
  std::vector<StreamId> order;  // of all frames
  std::vector<session::NoChange> no_changes;
  std::map<StreamId, std::vector<SessionId>> receivers;
  std::set<StreamId> encoders;
  std::vector<renderer::ShadeView> views;
};

class FakeViewRenderer : public runtime::Actor<renderer::ViewInbox> {
 public:
  FakeViewRenderer(runtime::Context<renderer::ViewInbox> context, Heard* heard)
      : Actor(std::move(context)), heard_(heard) {}
  void on(renderer::ShadeView&& m) { heard_->views.push_back(m); }
  void on(renderer::LightStored&&) {}
  void on(renderer::ViewSliceFinished&&) {}

 private:
  Heard* heard_;
};

class FakeRenderer : public runtime::Actor<renderer::Inbox> {
 public:
  FakeRenderer(runtime::Context<renderer::Inbox> context, Heard* heard) : Actor(std::move(context)), heard_(heard) {}
  void on(renderer::ShadeTiles&& m) { heard_->work.push_back(m); }
  void on(renderer::SliceFinished&&) {}

 private:
  Heard* heard_;
};

class FakeEncoder : public runtime::Actor<encoder::Inbox> {
 public:
  FakeEncoder(runtime::Context<encoder::Inbox> context, Heard* heard, StreamId stream)
      : Actor(std::move(context)), heard_(heard), stream_(stream) {}
  void on(encoder::ComposeFrame&& m) {
    heard_->order.push_back(stream_);
    heard_->frames[stream_].push_back(std::move(m));
  }
  void on(encoder::PictureEncoded&&) {}

 private:
  Heard* heard_;
  StreamId stream_;
};

class FakeSession : public runtime::Actor<session::Inbox> {
 public:
  FakeSession(runtime::Context<session::Inbox> context, Heard* heard) : Actor(std::move(context)), heard_(heard) {}
  void on(session::NoChange&& m) { heard_->no_changes.push_back(m); }
  template <class M>
  void on(M&&) {}

 private:
  Heard* heard_;
};

class TileScheduler : public ::testing::Test {
 protected:
  explicit TileScheduler(Microseconds first_frame_wait = 0, float view_weight = 0)
      : world_(testing::make_room()), peers_(std::make_shared<Peers>()) {
    renderer_ = system_.spawn<FakeRenderer>("renderer", 16, &heard_);
    peers_->renderer = [this] { return renderer_; };
    peers_->make_encoder = [this](StreamId id, const StreamFormat&) {
      heard_.encoders.insert(id);
      const auto name = "encoder/" + std::to_string(static_cast<unsigned>(id));
      return encoders_[id] = system_.spawn<FakeEncoder>(name, 16, &heard_, id);
    };
    peers_->destroy_encoder = [this](StreamId id, const runtime::Ref<encoder::Inbox>& encoder) {
      heard_.encoders.erase(id);
      system_.stop(encoder);
    };
    peers_->set_receivers = [this](StreamId id, std::vector<SessionId> who) { heard_.receivers[id] = std::move(who); };
    peers_->sessions = std::make_shared<runtime::Registry<SessionId, session::Inbox>>();
    std::shared_ptr<const Peers> peers = peers_;
    SchedulerOptions options;
    options.first_frame_wait = first_frame_wait;
    view_renderer_ = system_.spawn<FakeViewRenderer>("view_renderer", 16, &heard_);
    peers_->view_renderer = [this] { return view_renderer_; };
    const auto materials = std::make_shared<std::vector<scene::ViewMaterial>>(world_.scene->instances.size());
    for (auto& m : *materials) m.weight = view_weight;
    scheduler_ = system_.spawn<TileSchedulerActor>("tile_scheduler", 256, world_.layout, world_.rays, peers, options,
                                                   runtime::null_metrics(), materials);
    system_.run_until_idle();
  }

  void open(SessionId id, std::uint32_t phystex_size = 1024, std::uint32_t view_phystex = 512) {
    peers_->sessions->add(
        id, system_.spawn<FakeSession>("session/" + std::to_string(static_cast<unsigned>(id)), 16, &heard_));
    StreamFormat format;
    format.phystex_size = phystex_size;
    format.view_phystex = view_phystex;
    scheduler_.tell(SessionOpened(id, format, target_error_));
    system_.run_until_idle();
  }
  float target_error_ = 0.002f;  // of sessions that are opened
  void look(SessionId id, CameraSequence sequence, const Camera& camera) {
    scheduler_.tell(ViewChanged(id, sequence, camera, Viewport{160, 90}, FrameStamps{}));
    system_.run_until_idle();
  }
  // The renderer has shaded everything it was last asked to display.
  void shade_all(std::uint32_t version) {
    std::vector<ShadedTile> tiles;
    for (const auto& request : *heard_.work.back().work) {
      if (!request.display) continue;
      ShadedTile tile;
      tile.tile = request.tile;
      tile.version = version;
      tile.error = 0.02f;
      tile.image = std::make_shared<TileImage>();
      tiles.push_back(tile);
    }
    scheduler_.tell(TilesShaded(std::move(tiles)));
    system_.run_until_idle();
  }
  // The encoder has finished its newest frame.
  void finish_frame(StreamId stream, bool ok = true) {
    scheduler_.tell(FrameDone(stream, heard_.frames[stream].back().frame, ok));
    system_.run_until_idle();
  }
  void tick() { system_.advance(100ms); }

  const Camera ahead_ = look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55);
  const Camera aside_ = look_at({0.3, 0.4, 1.5}, {-4, 0, -2}, 55);
  const SessionId ann_{1};
  const StreamId first_{1};
  Heard heard_;
  testing::TestWorld world_;
  std::shared_ptr<Peers> peers_;
  runtime::DeterministicSystem system_;
  runtime::Ref<renderer::Inbox> renderer_;
  runtime::Ref<renderer::ViewInbox> view_renderer_;
  std::map<StreamId, runtime::Ref<encoder::Inbox>> encoders_;  // ever made
  runtime::Ref<tile_scheduler::Inbox> scheduler_;
};

}  // namespace darm::tile_scheduler
