// links: darm_client_core darm_proto
// What a hostile server can make of the client: a stream of framed Envelopes into the scene model and the stream
// player.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "client/core/scene_model.hpp"
#include "client/core/stream_player.hpp"
#include "proto/framing.hpp"

namespace {

using namespace darm;
using namespace darm::client;

constexpr std::size_t kMaxInput = 1 << 20;

struct Client {
  std::optional<SceneModel> scene;
  std::optional<StreamPlayer> player, view_player;
  StreamShape shape, view_shape;

  void welcome(const wire::Welcome& w) {
    // Real clients take what they asked for; smaller sizes keep each run short.
    shape = {w.phystex_size() % 512, w.chroma_444(), w.lossless()};
    view_shape = {w.view_phystex() % 512, w.chroma_444(), w.lossless()};
  }
  void manifest(const wire::SceneManifest& m) {
    SceneLimits limits;
    limits.max_geometry_bytes = 16u << 20;
    auto made = SceneModel::from_manifest(m, limits);
    if (!made || made->tile_count() > 1u << 20) return;
    scene.emplace(std::move(*made));
    player.reset();
    auto stream = StreamPlayer::create(*scene, shape);
    if (stream) player.emplace(std::move(*stream));
    view_player.reset();
    auto view_stream = StreamPlayer::create(*scene, view_shape);
    if (view_stream) view_player.emplace(std::move(*view_stream));
  }
  void take(const wire::Envelope& e) {
    if (e.has_welcome()) welcome(e.welcome());
    if (e.has_manifest()) manifest(e.manifest());
    if (e.has_geometry() && scene) (void)scene->add_chunk(e.geometry());
    if (view_player && e.has_view_frame()) {
      (void)view_player->apply(e.view_frame(), *scene);
      (void)view_player->take_news();
    }
    if (!player) return;
    if (e.has_frame()) (void)player->apply(e.frame(), *scene);
    if (e.has_coarse()) (void)player->apply(e.coarse(), *scene);
    (void)player->take_news();
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > kMaxInput) return 0;
  proto::FrameReader frames(kMaxInput);
  frames.feed(std::span(data, size));
  Client client;
  client.shape.phystex_size = client.view_shape.phystex_size = 64;
  wire::Envelope envelope;
  for (;;) {
    const auto got = frames.next(envelope);
    if (!got || !*got) return 0;
    client.take(envelope);
  }
}
