// One actor of the daemon: keeps the newest coarse still and hands it to sessions.
#pragma once

#include <memory>

#include "actors/encoder/coarse_still.hpp"
#include "actors/runtime/actor.hpp"
#include "actors/runtime/metrics.hpp"
#include "actors/runtime/registry.hpp"

namespace darm::encoder {

using SessionRegistry = runtime::Registry<SessionId, session::Inbox>;

/// Encodes on the pool, one picture at a time, always the newest. Every new still goes to all sessions; a session that
/// asks before there is one gets the first.
class CoarseEncoderActor : public runtime::Actor<CoarseInbox> {
 public:
  CoarseEncoderActor(runtime::Context<CoarseInbox> context, std::shared_ptr<SessionRegistry> sessions,
                     CoarseStillOptions options, runtime::MetricSink& metrics);
  ~CoarseEncoderActor() override;

  void on(CoarseShaded&& event);
  void on(CoarseWanted&& request);
  void on(CoarseEncoded&& event);

 private:
  struct Job;
  void begin();

  std::shared_ptr<SessionRegistry> sessions_;
  CoarseStillOptions options_;
  runtime::MetricSink& metrics_;
  std::shared_ptr<const CoarsePicture> next_;
  std::shared_ptr<Job> job_;
  std::shared_ptr<const session::CoarseTexture> newest_;
};

}  // namespace darm::encoder
