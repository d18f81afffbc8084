#include "actors/encoder/coarse_encoder_actor.hpp"

#include <exception>
#include <utility>

namespace darm::encoder {

struct CoarseEncoderActor::Job {
  explicit Job(std::shared_ptr<const CoarsePicture> p) : picture(std::move(p)) {}
  std::shared_ptr<const CoarsePicture> picture;
  std::shared_ptr<const session::CoarseTexture> texture;  // null: failed
};

CoarseEncoderActor::CoarseEncoderActor(runtime::Context<CoarseInbox> context, std::shared_ptr<SessionRegistry> sessions,
                                       CoarseStillOptions options, runtime::MetricSink& metrics)
    : Actor(std::move(context)), sessions_(std::move(sessions)), options_(options), metrics_(metrics) {}

CoarseEncoderActor::~CoarseEncoderActor() = default;

void CoarseEncoderActor::on(CoarseShaded&& event) {
  if (!event.picture) return;
  next_ = std::move(event.picture);
  if (!job_) begin();
}

void CoarseEncoderActor::begin() {
  job_ = std::make_shared<Job>(std::exchange(next_, nullptr));
  auto work = [job = job_, options = options_, me = self()] {
    try {
      if (auto made = encode_coarse(*job->picture, options)) job->texture = std::move(*made);
    } catch (const std::exception&) {
      job->texture = nullptr;  // out of memory: counted as a failure below
    }
    me.tell(CoarseEncoded(job->picture->version));
  };
  executor().post(runtime::Priority::kNormal, std::move(work));
}

void CoarseEncoderActor::on(CoarseWanted&& request) {
  // Without one yet, the first still reaches everybody in the registry, this session included.
  if (newest_) sessions_->find(request.session).tell(session::CoarseUpdated(newest_));
}

void CoarseEncoderActor::on(CoarseEncoded&&) {
  const auto job = std::exchange(job_, nullptr);
  if (job && job->texture) {
    newest_ = job->texture;
    metrics_.count("darm_coarse_stills_total");
    metrics_.set("darm_coarse_bytes", static_cast<double>(newest_->h264.size()));
    sessions_->for_each([&](SessionId, const auto& ref) { ref.tell(session::CoarseUpdated(newest_)); });
  } else {
    metrics_.count("darm_coarse_failures_total");
  }
  if (next_) begin();
}

}  // namespace darm::encoder
