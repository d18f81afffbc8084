#include "actors/encoder/encoder_actor.hpp"

#include <algorithm>
#include <exception>

#include "actors/encoder/codec_quality.hpp"
#include "actors/encoder/h264_encoder.hpp"
#include "actors/encoder/phystex_picture.hpp"

namespace darm::encoder {
namespace {

Microseconds micros(const runtime::Executor& executor) {
  return std::chrono::duration_cast<std::chrono::microseconds>(executor.now().time_since_epoch()).count();
}

constexpr std::chrono::milliseconds kTellAgainAfter{20};
constexpr int kMostTries = 3;           // at a key frame of a limited size
constexpr std::size_t kEditBytes = 10;  // of a page edit as it is sent, about

// FrameDone must arrive, or the stream stands still: a full mailbox is tried again until it takes it.
void tell_done(runtime::Executor& executor, const runtime::Ref<tile_scheduler::Inbox>& scheduler,
               const tile_scheduler::FrameDone& done) {
  if (scheduler.tell(done) || !scheduler) return;
  executor.after(kTellAgainAfter, [&executor, scheduler, done] { tell_done(executor, scheduler, done); });
}

double seconds(Microseconds from, Microseconds to) { return static_cast<double>(to - from) * 1e-6; }

}  // namespace

// Picture and codec of the stream. The codec may be missing after a failure; the next key frame makes it anew.
struct EncoderActor::Pipeline {
  explicit Pipeline(const EncoderOptions& o) : lossless(o.lossless_rgb), quality(o.crf, o.crf_finest) {
    settings.width = o.phystex_size;
    settings.height = o.phystex_size;
    settings.chroma_444 = o.chroma_444;
    settings.crf = o.crf;
    settings.preset = o.preset;
    settings.codec = o.codec;
    settings.threads = o.threads;
    settings.frames_per_second = o.frames_per_second;
    if (!lossless) picture.emplace(o.phystex_size, o.chroma_444);
  }
  H264Settings settings;
  bool lossless;
  CodecQuality quality;
  std::optional<PhysTexPicture> picture;
  std::unique_ptr<H264Encoder> encoder;
};

struct EncoderActor::Job {
  explicit Job(ComposeFrame&& c) : command(std::move(c)) {}
  ComposeFrame command;
  std::shared_ptr<session::EncodedFrame> frame = std::make_shared<session::EncodedFrame>();
  Microseconds started = 0;
  Microseconds composed = 0;
  Microseconds encoded = 0;
  Microseconds busy = 0;  // processor time of it all; the codec has one thread, ours
  bool settled = true;    // the same picture again would not be finer
  bool limited = false;   // it would have been finer without its limit of bytes
  std::string error;      // empty: frame is good
};

EncoderActor::EncoderActor(runtime::Context<Inbox> context, EncoderOptions options, Receivers receivers,
                           runtime::Ref<tile_scheduler::Inbox> scheduler, runtime::MetricSink& metrics)
    : Actor(std::move(context)),
      options_(std::move(options)),
      receivers_(std::move(receivers)),
      scheduler_(std::move(scheduler)),
      metrics_(metrics),
      pipeline_(std::make_shared<Pipeline>(options_)) {}

EncoderActor::~EncoderActor() = default;

void EncoderActor::on(ComposeFrame&& command) {
  waiting_.push_back(std::move(command));
  if (job_) return;
  auto next = std::move(waiting_.front());
  waiting_.pop_front();
  begin(std::move(next));
}

void EncoderActor::begin(ComposeFrame&& command) {
  if (key_required_ && !command.key) {
    // Its edits build on a page table that clients of the failed frame do not have. The tiles are still worth keeping.
    if (pipeline_->picture) {
      for (const auto& w : command.writes) {
        if (w.image) pipeline_->picture->write(w.slot, *w.image);
      }
    }
    tell_done(executor(), scheduler_, tile_scheduler::FrameDone(options_.stream, command.frame, false));
    return;
  }
  job_ = std::make_shared<Job>(std::move(command));
  auto work = [pipeline = pipeline_, job = job_, &world = executor(), me = self()] {
    run(*pipeline, *job, world);
    me.tell(PictureEncoded(job->command.frame));
  };
  executor().post(runtime::Priority::kHigh, std::move(work));
}

void EncoderActor::run(Pipeline& pipeline, Job& job, const runtime::Executor& executor) {
  job.started = micros(executor);
  const auto busy_before = executor.thread_time();
  auto& frame = *job.frame;
  frame.frame = job.command.frame;
  frame.key = job.command.key;
  frame.error = job.command.error;
  try {
    if (pipeline.lossless) {
      frame.lossless = std::move(job.command.writes);
      job.composed = micros(executor);
    } else {
      for (const auto& w : job.command.writes) {
        if (!w.image || !pipeline.picture->write(w.slot, *w.image)) job.error = "a write names no slot or no image";
      }
      job.composed = micros(executor);
      if (job.error.empty()) code(pipeline, job);
    }
    frame.edits = std::move(job.command.edits);
  } catch (const std::exception& e) {
    job.error = e.what();
  }
  if (!job.error.empty()) pipeline.encoder.reset();
  job.encoded = micros(executor);
  job.busy = (executor.thread_time() - busy_before).count();
}

// A key frame that is too large for its link is coded again, coarser.
void EncoderActor::code(Pipeline& pipeline, Job& job) {
  auto& frame = *job.frame;
  auto& quality = pipeline.quality;
  for (int tries = 0; tries == 0 || (quality.too_large() && tries < kMostTries); ++tries) {
    const float crf = quality.next(frame.key, frame.error, job.composed, job.command.most_bytes);
    // libx264 makes a key frame as fine as the frames before it were, whatever the factor; a new one as it is told.
    if (frame.key && quality.limited()) pipeline.encoder.reset();
    if (!pipeline.encoder) {
      pipeline.settings.crf = crf;
      auto made = H264Encoder::create(pipeline.settings);
      if (!made) {
        job.error = made.error().message;
        return;
      }
      pipeline.encoder = std::move(*made);
    }
    pipeline.encoder->set_crf(crf);
    auto bytes = pipeline.encoder->encode(pipeline.picture->view(), frame.key);
    if (!bytes) {
      job.error = bytes.error().message;
      return;
    }
    frame.h264 = std::move(*bytes);
    quality.coded(frame.h264.size(), job.composed);
  }
  job.settled = quality.settled();
  job.limited = quality.limited();
}

void EncoderActor::on(PictureEncoded&& event) {
  if (!job_ || job_->command.frame != event.frame) return;
  const auto job = std::exchange(job_, nullptr);
  key_required_ = !job->error.empty();
  record(*job);
  if (job->error.empty()) publish(*job);
  tile_scheduler::FrameDone done(options_.stream, event.frame, job->error.empty(), job->settled, job->busy);
  done.key = job->frame->key;
  done.limited = job->limited;
  done.bytes = job->frame->h264.size() + job->frame->lossless.size() * sizeof(TileImage::rgb) +
               job->frame->edits.size() * kEditBytes;
  tell_done(executor(), scheduler_, done);
  while (!job_ && !waiting_.empty()) {
    auto next = std::move(waiting_.front());
    waiting_.pop_front();
    begin(std::move(next));
  }
}

void EncoderActor::publish(Job& job) {
  job.frame->stream = options_.stream;
  job.frame->layer = options_.layer;
  const std::shared_ptr<const session::EncodedFrame> frame = job.frame;
  for (const auto& [id, ref] : receivers_()) {
    ViewAnswer answer;
    answer.session = id;
    const auto own = std::find_if(job.command.answers.begin(), job.command.answers.end(),
                                  [&, wanted = id](const ViewAnswer& a) { return a.session == wanted; });
    if (own != job.command.answers.end()) answer = *own;
    const auto error = std::find_if(job.command.errors.begin(), job.command.errors.end(),
                                    [wanted = id](const ViewError& e) { return e.session == wanted; });
    const bool told = error != job.command.errors.end();
    answer.error = told ? error->error : job.command.error;
    answer.resolution_error = told ? error->resolution : 0.0f;
    answer.omitted_error = told ? error->omitted : 0.0f;
    answer.stamps.encode_started = job.started;
    answer.stamps.picture_composed = job.composed;
    answer.stamps.encoded = job.encoded;
    if (!ref.tell(session::FrameEncoded(frame, answer))) {
      // A session that is too busy to take the frame has lost it; later ones would build on what it lacks.
      metrics_.count("darm_encoder_frames_refused_total");
      scheduler_.tell(tile_scheduler::KeyFrameWanted(id, options_.layer));
    }
  }
}

void EncoderActor::record(const Job& job) {
  if (!job.error.empty()) {
    metrics_.count("darm_encoder_failures_total");
    return;
  }
  if (options_.layer == StreamLayer::kView) {
    metrics_.observe("darm_view_encode_seconds", seconds(job.started, job.encoded));
    metrics_.count("darm_view_frames_total");
    metrics_.count("darm_view_bytes_total", static_cast<double>(job.frame->h264.size()));
    return;
  }
  metrics_.count("darm_encoder_processor_seconds_total", static_cast<double>(job.busy) * 1e-6);
  metrics_.observe("darm_encoder_compose_seconds", seconds(job.started, job.composed));
  metrics_.observe("darm_encoder_encode_seconds", seconds(job.composed, job.encoded));
  metrics_.count("darm_encoder_frames_total");
  metrics_.count("darm_encoder_bytes_total", static_cast<double>(job.frame->h264.size()));
  if (job.frame->key) metrics_.count("darm_encoder_key_frames_total");
}

}  // namespace darm::encoder
