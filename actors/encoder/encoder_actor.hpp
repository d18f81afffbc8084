// One actor per stream: tiles in, encoded pictures out to every session of the stream.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "actors/encoder/encoder_messages.hpp"
#include "actors/runtime/actor.hpp"
#include "actors/runtime/metrics.hpp"
#include "actors/session/session_messages.hpp"
#include "actors/tile_scheduler/tile_scheduler_messages.hpp"

namespace darm::encoder {

struct EncoderOptions {
  StreamId stream{};
  StreamLayer layer = StreamLayer::kShared;
  std::uint32_t phystex_size = 2048;  ///< pixels per side, a multiple of 32; up to 8192 with a codec
  bool chroma_444 = false;
  bool lossless_rgb = false;  ///< no codec: tiles go out as they are
  float crf = 16.0f;          ///< while light is rough, and of key frames
  float crf_finest = 8.0f;    ///< reached as light gets exact (CodecQuality)
  std::string preset = "superfast";
  std::string codec = "libx264";
  unsigned threads = 1;
  float frames_per_second = 10.0f;
};

/// Who receives the stream now. Called on the actor's turn whenever a frame is ready; thread-safe.
using Receivers = std::function<std::vector<std::pair<SessionId, runtime::Ref<session::Inbox>>>()>;

/// Composes and encodes on the pool, one frame at a time. A codec that fails is made anew: the frame is reported with
/// FrameDone(ok = false), and frames are refused in the same way until the scheduler sends a key frame.
class EncoderActor : public runtime::Actor<Inbox> {
 public:
  EncoderActor(runtime::Context<Inbox> context, EncoderOptions options, Receivers receivers,
               runtime::Ref<tile_scheduler::Inbox> scheduler, runtime::MetricSink& metrics);
  ~EncoderActor() override;

  void on(ComposeFrame&& command);
  void on(PictureEncoded&& event);

 private:
  struct Pipeline;
  struct Job;
  void begin(ComposeFrame&& command);
  static void run(Pipeline& pipeline, Job& job, const runtime::Executor& executor);
  static void code(Pipeline& pipeline, Job& job);
  void publish(Job& job);
  void record(const Job& job);

  EncoderOptions options_;
  Receivers receivers_;
  runtime::Ref<tile_scheduler::Inbox> scheduler_;
  runtime::MetricSink& metrics_;
  std::shared_ptr<Pipeline> pipeline_;  // touched by the one job under way
  std::shared_ptr<Job> job_;            // null: idle
  std::deque<ComposeFrame> waiting_;    // the contract keeps this at one or none
  bool key_required_ = true;
};

}  // namespace darm::encoder
