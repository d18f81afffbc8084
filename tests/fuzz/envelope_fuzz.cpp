// links: darm_session
// A client that says anything: framing, parsing and the whole protocol must neither crash nor grow without bound.
#include <cstdlib>

#include "actors/session/session_protocol.hpp"
#include "proto/limits.hpp"

using namespace darm;
using namespace darm::session;

namespace {

std::shared_ptr<const GeometryStream> empty_scene() {
  scene::Scene s;
  atlas::Layout l;
  l.levels.emplace_back();
  return GeometryStream::build(s, l, 1.0f, 1).value();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto scene = empty_scene();
  static const auto bodies = std::make_shared<FrameBodies>();
  SessionPolicy policy;
  policy.allow_lossless = true;
  SessionProtocol protocol(SessionId{1}, policy, std::string(32, 'k'), 0, scene, bodies, 0);
  // The first byte cuts the stream into pieces, and says whether a good Hello comes first.
  const std::size_t piece = size > 0 ? std::size_t{1} + data[0] / 2 : 1;
  Microseconds now = 0;
  if (size > 0 && data[0] % 2 == 0) {
    wire::Envelope hello;
    hello.mutable_hello()->set_version(proto::kProtocolVersion);
    (void)protocol.on_bytes(proto::frame(hello), now);
  }
  for (std::size_t at = 1; at < size; at += piece) {
    now += 1000;
    for (const auto& action : protocol.on_bytes({data + at, std::min(piece, size - at)}, now)) {
      if (const auto* view = std::get_if<tile_scheduler::ViewChanged>(&action)) {
        if (!is_valid(view->camera) || !is_valid(view->viewport) || view->sequence == 0) std::abort();
      }
    }
    (void)protocol.on_tick(now);
    while (!protocol.next_packets(now).empty()) (void)protocol.on_sent(now);
  }
  return 0;
}
