// Looks: which view is traced next and with how many rays, who looks for whom, what follows from it.
#include <algorithm>
#include <cmath>
#include <utility>

#include "actors/tile_scheduler/tile_scheduler_actor.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr std::size_t kMany = 16;               // sessions; whole passes of all of them at once would take seconds
constexpr int kMovingPeriods = 3;               // a view that has not moved for so many updates rests
constexpr std::uint32_t kRaysPerSlice = 8'192;  // fewer are not worth a second thread

// One step of a slice. The next one waits behind those of other views, so that a small view need not wait for a large
// one.
void post_step(runtime::Executor& executor, std::shared_ptr<ViewJob> job, unsigned slice,
               runtime::Ref<tile_scheduler::Inbox> scheduler) {
  executor.post(runtime::Priority::kHigh, [&executor, job = std::move(job), slice, scheduler = std::move(scheduler)] {
    const auto before = executor.thread_time();
    const auto step = job->run_step(slice);
    job->note_busy((executor.thread_time() - before).count());
    if (step == ViewJob::Step::kMore) post_step(executor, job, slice, scheduler);
    if (step == ViewJob::Step::kAllDone) scheduler.tell(ViewTraced(job->number()));
  });
}

ViewAnswer answer_to(const ViewChanged& view) {
  ViewAnswer answer;
  answer.session = view.session;
  answer.sequence = view.sequence;
  answer.stamps = view.stamps;
  return answer;
}

}  // namespace

void TileSchedulerActor::count_moving() {
  const auto since = now_us() - kMovingPeriods * period_;
  moving_ = view_streams_ = 0;
  for (const auto& [id, session] : sessions_) {
    moving_ += session->moved_at && *session->moved_at > since ? 1 : 0;
    view_streams_ += session->view_layer && session->view_layer->target_size() > 0 ? 1 : 0;
  }
}

// Where there are many, a pose that has only been glanced at waits for its passes as those do that only refine.
int TileSchedulerActor::passes_due(Session& session, bool moved) {
  if (moved) return options_.passes_moving;
  const int done = session.set.passes();
  const bool glanced = sessions_.size() > kMany && session.set.current().samples() > 0;
  if ((glanced || done >= options_.passes_unlit) && !looking_.allows(now_us())) return 0;
  const bool lit = session.stream && session.stream->demand.lit >= options_.lit;
  if (!lit && done >= options_.passes_unlit && ++session.updates_waited < options_.updates_unlit) return 0;
  session.updates_waited = 0;
  return std::min(options_.passes_still, kAllPasses - done);
}

// Of a pass; kMaxRays: all there are.
std::uint32_t TileSchedulerActor::rays_due(const Session& session, bool moved) {
  if (!moved || moving_ < 2) return kMaxRays;
  const auto interval = look_interval(session);
  auto rays = looking_.glance(moving_, interval);
  if (interval > period_) rays = std::min(rays, enough_rays(session, interval));
  const auto& viewport = session.view->viewport;
  const auto whole = std::uint64_t{block_rows(viewport)} * block_columns(viewport);
  return rays < whole ? std::min(rays, kMaxRays - 1) : kMaxRays;
}

Microseconds TileSchedulerActor::look_interval(const Session& session) const {
  const std::size_t members = session.stream ? session.stream->members.size() : 1;
  const auto crowds = std::min(members / std::max<std::size_t>(1, options_.crowd), options_.crowd_updates);
  if (crowds < 2) return period_;
  const auto turn = static_cast<Microseconds>(static_cast<std::uint64_t>(session.id) % 8);
  return std::max(period_, period_ * static_cast<Microseconds>(crowds) * (8 + turn) / 12);  // not all at once
}

// With what the others bring, so many are enough for a stream whose members move.
std::uint32_t TileSchedulerActor::enough_rays(const Session& session, Microseconds interval) const {
  const double looks = double(session.stream->members.size()) / (double(interval) * 1e-6);  // a second
  return std::max(TraceBudget::kLeastGlance, static_cast<std::uint32_t>(options_.crowd_rays / looks));
}

// One of a crowd has looked a moment ago from near where it is now: what is new there, some other has seen or will.
bool TileSchedulerActor::seen_by_others(const Session& session) const {
  const auto interval = look_interval(session);
  if (!session.posed || interval <= period_ || now_us() - session.last_start >= 2 * interval) return false;
  const auto& was = *session.posed;
  const auto& is = *session.view;
  const auto turned = std::abs(glm::dot(was.camera.orientation, is.camera.orientation));
  return glm::distance(was.camera.position, is.camera.position) <= near_ &&
         double(turned) >= std::cos(options_.near_angle / 2) && was.camera.fovy == is.camera.fovy &&
         was.viewport.width == is.viewport.width && was.viewport.height == is.viewport.height;
}

// Whoever looks at the very same picture, and knows or is finding out more of it, looks for this session too. True if
// there is nothing more to do now. (What depends on the eye comes of a look of its own.)
bool TileSchedulerActor::look_with_another(Session& session) {
  if (session.view_layer || session.job || !session.view) return false;
  const bool moved = !session.posed || !same_view(*session.posed, *session.view);
  const int done = moved ? 0 : session.set.passes();
  if (done >= kAllPasses) return false;
  const Session* best = nullptr;
  int most = done;
  bool looking = false;
  for (const auto& [id, other] : sessions_) {
    if (other.get() == &session || !other->posed || !same_view(*other->posed, *session.view)) continue;
    looking = looking || other->job != nullptr;
    const int passes = other->job && other->job->starts_pose ? 0 : other->set.passes();
    if (passes <= most) continue;
    best = other.get();
    most = passes;
  }
  if (best == nullptr) return looking;
  auto answer = answer_to(*session.view);
  answer.stamps.view_started = now_us();
  if (session.view->sequence <= session.taken_up) answer.sequence = 0;
  session.taken_up = session.view->sequence;
  session.last_start = answer.stamps.view_started;
  if (moved) session.posed = session.view;
  session.set.adopt(best->set, moved, answer.stamps.view_started);
  if (session.stream && session.stream->shared() && best->stream != session.stream) note_seen(session);
  if (moved && session.stream) session.stream->changed_at = session.last_start;
  know_view(session, answer);
  return true;
}

// Begins the next trace of a session's newest view, if there is something to find out.
void TileSchedulerActor::start_view(Session& session) {
  if (!session.view) return;
  if (seen_by_others(session)) {
    if (session.view->sequence > session.taken_up) answer_without_look(session);
    if (now_us() - session.last_start < look_interval(session)) return;
  }
  if (session.job || look_with_another(session)) return;
  const bool moved = !session.posed || !same_view(*session.posed, *session.view);
  const int done = moved ? 0 : session.set.passes();
  const int count = passes_due(session, moved);
  const bool unanswered = session.view->sequence > session.taken_up;
  if (count <= 0) {
    if (unanswered) answer_without_look(session);
    return;
  }
  session.taken_up = session.view->sequence;
  auto answer = answer_to(*session.view);
  answer.stamps.view_started = now_us();
  session.last_start = now_us();
  auto job = make_job(session, moved, done, count);
  job->answer = answer;
  if (!unanswered) job->answer.sequence = 0;
  job->starts_pose = moved;
  session.posed = session.posed && !moved ? session.posed : session.view;
  session.job = job;
  looking_.begin(job->rays(), session.last_start);
  post_slices(job);
}

void TileSchedulerActor::answer_without_look(Session& session) {
  session.taken_up = session.view->sequence;
  auto answer = answer_to(*session.view);
  answer.stamps.view_started = answer.stamps.view_ready = now_us();
  session.answer = answer;
  if (session.stream) compose(*session.stream);
}

std::shared_ptr<ViewJob> TileSchedulerActor::make_job(Session& session, bool moved, int done, int count) {
  const auto rays = rays_due(session, moved);
  const auto slices = std::clamp(rays / kRaysPerSlice, 1u, 2 * executor().workers());
  // What a view sees of its own while it moves, it sees when that can be made use of; all of it when it rests.
  const bool own = session.view_layer && (!moved || view_due(session));
  return std::make_shared<ViewJob>(next_job_++, layout_, rays_, session.view->camera, session.view->viewport, done,
                                   count, slices, materials_, own, rays);
}

void TileSchedulerActor::post_slices(const std::shared_ptr<ViewJob>& job) {
  for (unsigned slice = 0; slice < job->slice_count(); ++slice) post_step(executor(), job, slice, self());
}

void TileSchedulerActor::finish_view(Session& session) {
  const auto job = std::exchange(session.job, nullptr);
  const auto traced = now_us();
  looking_.end(job->rays(), job->busy());
  metrics_.count("darm_look_processor_seconds_total", double(job->busy()) * 1e-6);
  metrics_.observe("darm_view_trace_seconds", double(traced - job->answer.stamps.view_started) * 1e-6);
  const bool shared = session.stream && session.stream->shared();
  const int whole = passes_per_picture(session.posed->viewport);
  if (job->starts_pose) session.set.start_pose(traced, whole, !shared);
  if (job->starts_pose && session.stream) session.stream->changed_at = traced;
  const int before = session.set.passes();
  const double samples = job->samples();
  for (auto& part : job->take_results()) {
    if (shared) session.stream->together.add(part, static_cast<float>(part.samples() / samples));
    session.set.add(std::move(part), 0);
  }
  session.set.add(VisibleSet(), job->whole_passes());
  const bool no_more_guesses = before < whole && session.set.passes() >= whole;
  if (shared && (job->starts_pose || no_more_guesses)) session.stream->together.note_change();
  if (session.view_layer) see_own(session, *job);
  know_view(session, job->answer);
  for (auto& [id, other] : sessions_)
    if (other->view && session.posed && same_view(*other->view, *session.posed)) look_with_another(*other);
}

// There is more in the session's set: work and frames follow from it.
void TileSchedulerActor::know_view(Session& session, ViewAnswer answer) {
  if (!session.stream) {
    place(session);
  } else {
    auto& stream = *session.stream;
    session.ungrouped = true;
    stream.unchosen = true;
    stream.reweighed = 0;
    session.unchosen = !stream.shared() || known_share(session.set.current(), stream.known) < options_.known;
    choose_if_due(stream);
  }
  answer.stamps.view_ready = now_us();
  // One that came meanwhile may have been answered already.
  if (answer.sequence != 0 && answer.sequence >= session.taken_up) session.answer = answer;
  compose(*session.stream);
}

}  // namespace darm::tile_scheduler
