// What each session is told of its picture's errors.
#include <algorithm>
#include <cmath>

#include "actors/tile_scheduler/tile_scheduler_actor.hpp"
#include "actors/tile_scheduler/view_tone.hpp"

namespace darm::tile_scheduler {

// An error takes a millisecond to know: where many share a stream, each of theirs is looked at less often.
void TileSchedulerActor::estimate_errors(Stream& stream, Microseconds apart) {
  const auto now = now_us();
  const auto enough = apart * static_cast<Microseconds>(stream.members.size() - 1);
  for (auto* member : stream.members) {
    if (member->error_at && now - *member->error_at < enough) continue;
    member->error_at = now;
    estimate_error(stream, *member);
  }
}

void TileSchedulerActor::estimate_error(const Stream& stream, Session& session) const {
  const auto& seen = session.set.current();
  const bool nothing = seen.samples() > 0 && seen.chains().empty();  // but the sky
  const auto& demand = stream.demand;
  const bool coarse = coarse_ != nullptr;
  const int level = layout_->coarse_level();
  const auto tone = tone_of(seen, coarse_.get());
  const auto options = error_options(tone);
  session.light_error = nothing ? 0.0f
                        : stream.shared()
                            ? view_error(seen, stream.known, demand, images(), level, coarse, options)
                            : view_error(demand.chains, demand.granted.served, images(), level, coarse, options);
  session.told.resolution = seen.resolution_error() * tone.variety;
  session.told.omitted = omitted_error(seen, tone);
  double squared = double{session.light_error} * double{session.light_error};
  if (session.view_layer) {
    // Of the samples on surfaces, as the light's is. Until its tiles are chosen the layer lacks all that it will hold.
    const double share = seen.samples() > 0 ? std::min(1.0, seen.surface_samples() / seen.samples()) : 1.0;
    squared += !session.view_posed ? double{session.told.omitted} * double{session.told.omitted}
               : share > 0         ? session.view_layer->squared_error(shown_of_omitted(tone)) / share
                                   : 0.0;
    session.told.omitted = 0;
  }
  session.told.error = static_cast<float>(std::min(1.0, std::sqrt(squared)));
}

// Of all who look at it: what its pictures are coded for.
float TileSchedulerActor::light_error(const Stream& stream) {
  double squares = 0;
  for (const auto* member : stream.members) squares += double{member->light_error} * double{member->light_error};
  return static_cast<float>(std::sqrt(squares / double(std::max<std::size_t>(1, stream.members.size()))));
}

void TileSchedulerActor::tell_no_change(const ViewAnswer& answer) {
  const auto* session = find(answer.session);
  ViewAnswer full = answer;
  full.resolution_error = session ? session->told.resolution : 0.0f;
  full.omitted_error = session ? session->told.omitted : 0.0f;
  peers_->sessions->find(answer.session).tell(session::NoChange(full, session ? session->told.error : 1.0f));
}

// Of a frame that is under way clients would read what was so before.
void TileSchedulerActor::tell_errors(Stream& stream) {
  stream.untold = stream.state.in_flight();
  if (stream.untold) return;
  for (const auto* member : stream.members) {
    ViewAnswer none;
    none.session = member->id;
    if (member->posed) tell_no_change(none);
  }
}

// One observation a view and update: quantiles over views, and the worst of now.
void TileSchedulerActor::record_errors() {
  double worst = 0;
  std::size_t done = 0, slow = 0;
  for (const auto& [id, session] : sessions_) {
    slow += session->format.lane > 0 ? 1 : 0;
    if (!session->posed) continue;
    metrics_.observe("darm_view_error", double(session->told.error));
    metrics_.observe("darm_view_resolution_error", double(session->told.resolution));
    metrics_.observe("darm_view_omitted_error", double(session->told.omitted));
    worst = std::max(worst, double(session->told.error));
    done += session->told.error <= session->target_error ? 1 : 0;
  }
  metrics_.set("darm_view_error_worst", worst);
  metrics_.set("darm_views_on_target", double(done));
  metrics_.set("darm_sessions_slow", double(slow));
}

}  // namespace darm::tile_scheduler
