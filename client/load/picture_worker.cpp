#include "client/load/picture_worker.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "client/core/egl_context.hpp"
#include "client/core/renderer_gles.hpp"
#include "client/core/scene_model.hpp"

namespace darm::client::load {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostWaitingBytes = std::size_t{64} << 20;
constexpr std::chrono::seconds kDrawEvery{1};

struct Shapes {
  StreamShape shared, own;
};

struct Job {
  std::size_t pupil = 0;
  std::size_t bytes = 0;
  std::variant<Shapes, wire::Envelope> what;
};

struct Counters {
  std::atomic<std::uint64_t> decoded{0}, skipped{0}, refused{0}, drawn{0};
};

View at_most_high(View view, std::uint32_t height) {
  if (view.height <= height) return view;
  view.width = std::max(1u, static_cast<std::uint32_t>(std::uint64_t{view.width} * height / view.height));
  view.height = height;
  return view;
}

// One client that decodes. Its thread is the worker's.
class Pupil {
 public:
  Pupil(bool draws, std::uint32_t draw_height, Counters& counters)
      : draws_(draws), draw_height_(draw_height), counters_(counters) {}

  void begin(const Shapes& shapes) { shapes_ = shapes; }
  void take(const wire::Envelope& envelope);
  void draw_if_due(const std::optional<View>& view);

 private:
  void take_manifest(const wire::SceneManifest& manifest);
  template <class Frame>
  void decode(std::optional<StreamPlayer>& player, const Frame& frame);
  void refuse() { ++counters_.refused; }

  bool draws_;
  std::uint32_t draw_height_;
  Counters& counters_;
  Shapes shapes_;
  std::optional<SceneModel> scene_;
  std::optional<StreamPlayer> player_, own_player_;
  std::unique_ptr<GlesRenderer> renderer_;
  Clock::time_point next_draw_ = Clock::now();
};

void Pupil::take_manifest(const wire::SceneManifest& manifest) {
  if (scene_) return refuse();
  auto scene = SceneModel::from_manifest(manifest);
  if (!scene) return refuse();
  scene_.emplace(std::move(*scene));
  auto player = StreamPlayer::create(*scene_, shapes_.shared);
  if (!player) return refuse();
  player_.emplace(std::move(*player));
  if (shapes_.own.phystex_size > 0) {
    auto own = StreamPlayer::create(*scene_, shapes_.own);
    if (!own) return refuse();
    own_player_.emplace(std::move(*own));
  }
  if (!draws_) return;
  auto renderer = GlesRenderer::create(*scene_, shapes_.shared);
  if (!renderer) return refuse();
  renderer_ = std::move(*renderer);
}

template <class Frame>
void Pupil::decode(std::optional<StreamPlayer>& player, const Frame& frame) {
  if (!player) return refuse();
  const bool waited = player->key_frame_wanted();
  const auto fate = player->apply(frame, *scene_);
  if (!fate) return refuse();
  if (*fate == FrameFate::kApplied) {
    ++counters_.decoded;
  } else if (!waited && player->key_frame_wanted() && frame.frame() == player->frame_shown() + 1) {
    refuse();  // in order, and yet without a picture
  } else if (frame.key()) {
    refuse();
  } else {
    ++counters_.skipped;
  }
  // Nobody draws: what came is not kept.
  if (!renderer_) (void)player->take_news();
}

void Pupil::take(const wire::Envelope& envelope) {
  switch (envelope.body_case()) {
    case wire::Envelope::kManifest:
      return take_manifest(envelope.manifest());
    case wire::Envelope::kGeometry:
      if (draws_ && scene_ && !scene_->add_chunk(envelope.geometry())) refuse();
      return;
    case wire::Envelope::kCoarse:
      if (!player_ || !player_->apply(envelope.coarse(), *scene_)) refuse();
      return;
    case wire::Envelope::kFrame:
      return decode(player_, envelope.frame());
    case wire::Envelope::kViewFrame:
      return decode(own_player_, envelope.view_frame());
    default:
      return;
  }
}

void Pupil::draw_if_due(const std::optional<View>& view) {
  const auto now = Clock::now();
  if (!renderer_ || !view || !player_->has_coarse() || now < next_draw_) return;
  next_draw_ = std::max(next_draw_ + kDrawEvery, now);
  bool good = renderer_->synchronise(*scene_, *player_).has_value();
  if (own_player_) good = good && renderer_->synchronise_view(*scene_, *own_player_).has_value();
  good = good && renderer_->draw(*scene_, at_most_high(*view, draw_height_)).has_value();
  renderer_->finish();
  good ? ++counters_.drawn : ++counters_.refused;
}

}  // namespace

struct PictureWorker::State {
  class Sink final : public PictureSink {
   public:
    Sink(State& state, std::size_t pupil) : state_(state), pupil_(pupil) {}
    void begin(const StreamShape& shape, const StreamShape& view_shape) override {
      state_.push({pupil_, sizeof(Shapes), Shapes{shape, view_shape}});
    }
    void look(const View& view) override { state_.look(pupil_, view); }
    void take(wire::Envelope envelope, std::size_t bytes) override {
      state_.push({pupil_, bytes, std::move(envelope)});
    }

   private:
    State& state_;
    std::size_t pupil_;
  };

  mutable std::mutex mutex;
  std::condition_variable changed;
  std::deque<Job> jobs;
  std::size_t waiting_bytes = 0;
  bool stopping = false;
  std::uint32_t draw_height = 0;
  std::vector<std::optional<View>> views;
  std::vector<std::unique_ptr<Sink>> sinks;
  std::vector<std::shared_ptr<Pupil>> pupils;
  Counters counters;
  std::thread thread;

  void push(Job job);
  void look(std::size_t pupil, const View& view);
  void run(bool draws, std::promise<std::string>& ready);
  void work();
};

void PictureWorker::State::push(Job job) {
  const std::lock_guard lock(mutex);
  if (waiting_bytes + job.bytes > kMostWaitingBytes) {
    ++counters.skipped;
    return;
  }
  waiting_bytes += job.bytes;
  jobs.push_back(std::move(job));
  changed.notify_one();
}

void PictureWorker::State::look(std::size_t pupil, const View& view) {
  const std::lock_guard lock(mutex);
  views[pupil] = view;
}

void PictureWorker::State::run(bool draws, std::promise<std::string>& ready) {
  std::unique_ptr<EglContext> context;  // current on this thread until its end
  if (draws) {
    auto made = EglContext::create();
    if (!made) return ready.set_value(made.error().message);
    context = std::move(*made);
  }
  ready.set_value({});
  work();
  pupils.clear();  // what the GL holds goes before the context
}

void PictureWorker::State::work() {
  for (;;) {
    std::optional<Job> job;
    std::vector<std::shared_ptr<Pupil>> all;
    std::vector<std::optional<View>> looks;
    {
      std::unique_lock lock(mutex);
      changed.wait_for(lock, std::chrono::milliseconds(50), [&] { return stopping || !jobs.empty(); });
      if (stopping) return;
      if (!jobs.empty()) {
        job = std::move(jobs.front());
        jobs.pop_front();
        waiting_bytes -= job->bytes;
      }
      all = pupils;
      looks = views;
    }
    if (job) {
      auto& pupil = *all[job->pupil];
      if (const auto* shapes = std::get_if<Shapes>(&job->what)) pupil.begin(*shapes);
      if (const auto* envelope = std::get_if<wire::Envelope>(&job->what)) pupil.take(*envelope);
    }
    for (std::size_t i = 0; i < all.size(); ++i) all[i]->draw_if_due(looks[i]);
  }
}

PictureWorker::PictureWorker(std::unique_ptr<State> state) : state_(std::move(state)) {}

Result<std::unique_ptr<PictureWorker>> PictureWorker::create(bool draws, std::uint32_t draw_height) {
  std::unique_ptr<PictureWorker> worker(new PictureWorker(std::make_unique<State>()));
  worker->state_->draw_height = draw_height;
  std::promise<std::string> ready;
  auto error = ready.get_future();
  worker->state_->thread = std::thread([&state = *worker->state_, draws, &ready] { state.run(draws, ready); });
  if (auto why = error.get(); !why.empty()) return fail("--draw: " + why);
  return worker;
}

PictureWorker::~PictureWorker() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->stopping = true;
    state_->changed.notify_one();
  }
  if (state_->thread.joinable()) state_->thread.join();
}

PictureSink* PictureWorker::add(bool draws) {
  State& s = *state_;
  const std::lock_guard lock(s.mutex);
  s.pupils.push_back(std::make_shared<Pupil>(draws, s.draw_height, s.counters));
  s.views.emplace_back();
  s.sinks.push_back(std::make_unique<State::Sink>(s, s.sinks.size()));
  return s.sinks.back().get();
}

PictureCounts PictureWorker::counts() const {
  const Counters& c = state_->counters;
  return {c.decoded, c.skipped, c.refused, c.drawn};
}

}  // namespace darm::client::load
