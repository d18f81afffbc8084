#include "daemon/accuracy/replay.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include "actors/encoder/h264_decoder.hpp"
#include "actors/encoder/phystex_picture.hpp"

namespace darm::accuracy {
namespace {

Result<DecodedPlanes> decode(encoder::H264Decoder& decoder, const std::vector<std::uint8_t>& packet) {
  const auto picture = decoder.decode(packet);
  if (!picture) return std::unexpected(picture.error());
  return DecodedPlanes::copy(*picture);
}

// A still is a key frame of its own stream.
Result<void> show_coarse(ClientState& state, const session::CoarseTexture& texture) {
  auto decoder = encoder::H264Decoder::create();
  if (!decoder) return std::unexpected(decoder.error());
  auto planes = decode(**decoder, texture.h264);
  if (!planes) return std::unexpected(planes.error());
  state.set_coarse(std::move(*planes), texture.width, texture.height);
  return {};
}

// Frames and stills in the order in which they came.
struct Event {
  double seconds = 0;
  double samples = 0;
  const RecordedFrame* frame = nullptr;
  const RecordedCoarse* coarse = nullptr;
};

std::vector<Event> events_of(const Recording& recording) {
  std::vector<Event> events;
  for (const auto& f : recording.frames) events.push_back({f.seconds, f.samples, &f, nullptr});
  for (const auto& c : recording.coarse) events.push_back({c.seconds, c.samples, nullptr, &c});
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.seconds < b.seconds; });
  return events;
}

bool has_tiles(const RecordedFrame& frame) { return !frame.writes.empty(); }

}  // namespace

bool has_picture(const Recording& recording) {
  return !recording.coarse.empty() && std::any_of(recording.frames.begin(), recording.frames.end(), has_tiles);
}

Result<Replayed> replay(const Recording& recording, const atlas::Layout& layout, const SoftwareView& view,
                        const ShownHalves& reference, const ReplayOptions& options) {
  ClientState state(layout, options.phystex_size);
  auto decoder = encoder::H264Decoder::create();
  if (!decoder) return std::unexpected(decoder.error());
  Replayed out;
  const auto events = events_of(recording);
  for (std::size_t i = 0; i < events.size(); ++i) {
    const Event& e = events[i];
    if (e.coarse != nullptr) {
      if (auto shown = show_coarse(state, *e.coarse->texture); !shown) return std::unexpected(shown.error());
    } else {
      auto planes = decode(**decoder, e.frame->encoded->h264);
      if (!planes) return std::unexpected(planes.error());
      state.apply(e.frame->encoded->key, e.frame->encoded->edits, e.frame->writes);
      state.set_picture(std::move(*planes));
      out.bytes += static_cast<double>(e.frame->encoded->h264.size());
    }
    const bool last = i + 1 == events.size();
    const double next = last ? 0 : events[i + 1].seconds;
    // What is drawn is the picture that stands when a step is over, at the time at which it came.
    const bool due = out.curve.empty() || last || next >= out.curve.back().seconds * options.step;
    if (!state.has_coarse() || !due || (!out.curve.empty() && e.seconds <= out.curve.back().seconds)) continue;
    out.curve.push_back({e.seconds, psnr_to(view.draw(state, options.threads), reference, view.counted()), e.samples});
  }
  if (out.curve.empty()) return out;
  state.set_picture({});
  out.light_db = psnr_to(view.draw(state, options.threads), reference, view.counted());
  return out;
}

Result<Recoded> recode(const Recording& recording, const atlas::Layout& layout, const SoftwareView& view,
                       const ShownHalves& reference, const config::StreamConfig& stream, float crf, unsigned threads) {
  if (!has_picture(recording)) return fail("run: it has no picture");
  encoder::H264Settings settings;
  settings.width = settings.height = stream.phystex;
  settings.chroma_444 = stream.chroma_444;
  settings.preset = stream.preset;
  settings.crf = crf;
  settings.frames_per_second = static_cast<float>(stream.updates_per_second);
  auto coder = encoder::H264Encoder::create(settings);
  auto decoder = encoder::H264Decoder::create();
  if (!coder) return std::unexpected(coder.error());
  if (!decoder) return std::unexpected(decoder.error());
  encoder::PhysTexPicture picture(stream.phystex, stream.chroma_444);
  ClientState state(layout, stream.phystex);
  if (auto shown = show_coarse(state, *recording.coarse.back().texture); !shown) return std::unexpected(shown.error());
  Recoded out;
  double spent = 0;
  for (const auto& frame : recording.frames) {
    const auto start = std::chrono::steady_clock::now();
    for (const auto& w : frame.writes)
      if (w.image) picture.write(w.slot, *w.image);
    auto packet = (*coder)->encode(picture.view(), frame.encoded->key);
    spent += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!packet) return std::unexpected(packet.error());
    auto planes = decode(**decoder, *packet);
    if (!planes) return std::unexpected(planes.error());
    state.apply(frame.encoded->key, frame.encoded->edits, frame.writes);
    out.bytes += static_cast<double>(packet->size());
    const bool first = !out.first && view.share_of_tiles(state, threads) >= kMostlyTiles;
    const bool last = &frame == &recording.frames.back();
    if (!first && !last) continue;
    state.set_picture({});
    const auto before = view.draw(state, threads);
    state.set_picture(std::move(*planes));
    const auto after = view.draw(state, threads);
    const double codec_db = psnr_between(after, before, view.counted());
    if (first) out.first = {out.bytes, codec_db};
    if (last) out.last_codec_db = codec_db;
    out.curve.push_back({frame.seconds, psnr_to(after, reference, view.counted()), frame.samples});
  }
  out.encode_seconds = spent / static_cast<double>(recording.frames.size());
  return out;
}

}  // namespace darm::accuracy
