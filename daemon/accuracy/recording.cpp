#include "daemon/accuracy/recording.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "actors/runtime/threaded_system.hpp"
#include "daemon/pipeline.hpp"

namespace darm::accuracy {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr SessionId kSession{1};
constexpr auto kCameraInterval = std::chrono::milliseconds(100);
constexpr auto kStandstill = std::chrono::seconds(1);  // no busy machine keeps a waiting thread from waking for so long

// The one figure of the run that is read while it goes on.
class SampleCounter final : public runtime::MetricSink {
 public:
  void count(std::string_view name, double n, runtime::Labels) override {
    if (name == "darm_renderer_texel_samples_total") samples_ += n;
  }
  void observe(std::string_view, double, runtime::Labels) override {}
  void set(std::string_view, double, runtime::Labels) override {}
  [[nodiscard]] double samples() const { return samples_; }

 private:
  std::atomic<double> samples_{0};
};

// What the actors below write and the waiting thread reads.
class Notes {
 public:
  explicit Notes(const SampleCounter& counter) : counter_(counter) {}

  void begin() { start_ = Clock::now(); }
  [[nodiscard]] double now() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  void composed(FrameNumber frame, std::vector<encoder::SlotWrite> writes) {
    const std::lock_guard lock(mutex_);
    writes_[frame] = std::move(writes);
  }
  void encoded(std::shared_ptr<const session::EncodedFrame> frame) {
    const std::lock_guard lock(mutex_);
    auto writes = writes_.extract(frame->frame);
    const double t = now();
    if (writes && !writes.mapped().empty()) last_tiles_ = t;
    recording_.frames.push_back({t, counter_.samples(), std::move(frame),
                                 writes ? std::move(writes.mapped()) : std::vector<encoder::SlotWrite>()});
  }
  void coarse(std::shared_ptr<const session::CoarseTexture> texture) {
    const std::lock_guard lock(mutex_);
    recording_.coarse.push_back({now(), counter_.samples(), std::move(texture)});
  }
  void failed(const std::string& what) {
    const std::lock_guard lock(mutex_);
    if (failure_.empty()) failure_ = what;
  }
  [[nodiscard]] double last_tiles() const {
    const std::lock_guard lock(mutex_);
    return last_tiles_;
  }
  [[nodiscard]] std::string failure() const {
    const std::lock_guard lock(mutex_);
    return failure_;
  }
  [[nodiscard]] Recording take() {
    const std::lock_guard lock(mutex_);
    return std::move(recording_);
  }

 private:
  const SampleCounter& counter_;
  Clock::time_point start_ = Clock::now();
  mutable std::mutex mutex_;
  std::map<FrameNumber, std::vector<encoder::SlotWrite>> writes_;
  Recording recording_;
  double last_tiles_ = 0;
  std::string failure_;
};

// In a client's place: takes what its session would send.
class WatcherActor : public runtime::Actor<session::Inbox> {
 public:
  WatcherActor(runtime::Context<session::Inbox> context, std::shared_ptr<Notes> notes)
      : Actor(std::move(context)), notes_(std::move(notes)) {}
  void on(session::FrameEncoded&& m) {
    if (m.frame->layer == StreamLayer::kShared) notes_->encoded(std::move(m.frame));
  }
  void on(session::CoarseUpdated&& m) { notes_->coarse(std::move(m.coarse)); }
  void on(session::NoChange&&) {}
  void on(session::CloseSession&&) {}
  void on(session::BytesReceived&&) {}
  void on(session::BytesSent&&) {}
  void on(session::SocketClosed&&) {}
  void on(session::DatagramReceived&&) {}
  void on(session::Tick&&) {}

 private:
  std::shared_ptr<Notes> notes_;
};

// Between scheduler and encoder: keeps the tiles that go in, which no longer exist when the picture comes out.
class TapActor : public runtime::Actor<encoder::Inbox> {
 public:
  TapActor(runtime::Context<encoder::Inbox> context, std::shared_ptr<Notes> notes, runtime::Ref<encoder::Inbox> encoder)
      : Actor(std::move(context)), notes_(std::move(notes)), encoder_(std::move(encoder)) {}
  ~TapActor() override { system().stop(encoder_); }
  void on(encoder::ComposeFrame&& m) {
    notes_->composed(m.frame, m.writes);
    encoder_.tell(std::move(m));
  }
  void on(encoder::PictureEncoded&&) {}

 private:
  std::shared_ptr<Notes> notes_;
  runtime::Ref<encoder::Inbox> encoder_;
};

tile_scheduler::StreamFormat format_of(const RunOptions& options, const World& world) {
  tile_scheduler::StreamFormat format;
  format.phystex_size = options.config.stream.phystex;
  format.chroma_444 = options.config.stream.chroma_444;
  if (options.private_layer && world.has_view_layer()) format.view_phystex = options.config.stream.view_phystex;
  return format;
}

// A store that lives as long as its run. What is thrown away need not reach the disk: the file is emptied before it is
// closed.
class TemporaryStore {
 public:
  static Result<TemporaryStore> open(const config::Config& config, const World& world, const fs::path& folder) {
    std::error_code error;
    fs::remove_all(folder, error);
    fs::create_directories(folder, error);
    if (error) return fail(folder.string() + ": cannot be made: " + error.message());
    auto store = open_store(config, world, folder);
    if (!store) return std::unexpected(store.error());
    return TemporaryStore(folder, std::move(*store));
  }
  TemporaryStore(TemporaryStore&& other) noexcept
      : folder_(std::exchange(other.folder_, {})), store_(std::move(other.store_)) {}
  TemporaryStore(const TemporaryStore&) = delete;
  TemporaryStore& operator=(const TemporaryStore&) = delete;
  TemporaryStore& operator=(TemporaryStore&&) = delete;
  ~TemporaryStore() {
    if (folder_.empty()) return;
    std::error_code ignored;
    if (store_) fs::resize_file(store_->path(), 0, ignored);
    store_.reset();
    fs::remove_all(folder_, ignored);
  }
  [[nodiscard]] const std::shared_ptr<atlas::RadianceStore>& get() const { return store_; }

 private:
  TemporaryStore(fs::path folder, std::shared_ptr<atlas::RadianceStore> store)
      : folder_(std::move(folder)), store_(std::move(store)) {}
  fs::path folder_;
  std::shared_ptr<atlas::RadianceStore> store_;
};

// Sends the resting camera as a client does until the time is over, or nothing changes any more.
void watch(const RunOptions& options, const runtime::Ref<tile_scheduler::Inbox>& scheduler, Notes& notes,
           Recording& ended) {
  CameraSequence sequence = 0;
  for (auto next = Clock::now();; next += kCameraInterval) {
    scheduler.tell(tile_scheduler::ViewChanged(kSession, ++sequence, options.camera, options.viewport, FrameStamps{}));
    std::this_thread::sleep_until(next + kCameraInterval);
    ended.disturbed = Clock::now() - (next + kCameraInterval) > kStandstill;
    ended.seconds = notes.now();
    ended.stopped = options.stopped && options.stopped();
    ended.finished = has_settled(ended.seconds, notes.last_tiles());
    if (options.progress) options.progress(std::min(ended.seconds, options.seconds));
    if (ended.disturbed || ended.stopped || ended.finished || ended.seconds >= options.seconds ||
        !notes.failure().empty())
      return;
  }
}

}  // namespace

bool has_settled(double now, double last_tiles) { return last_tiles > 0 && now - last_tiles > std::max(3.0, now / 3); }

Result<Recording> record_run(const World& world, const RunOptions& options) {
  const auto store = TemporaryStore::open(options.config, world, options.folder);
  if (!store) return std::unexpected(store.error());
  SampleCounter counter;
  const auto notes = std::make_shared<Notes>(counter);
  Recording ended;
  {
    World with_store = world;
    with_store.store = store->get();
    runtime::ThreadedOptions threads;
    threads.workers = thread_count(options.config);
    threads.metrics = &counter;
    runtime::ThreadedSystem system(threads);
    system.supervisor().on_escalate([notes](const runtime::Failure& f) { notes->failed(f.actor + ": " + f.what); });
    const auto sessions = std::make_shared<StreamDirectory::Sessions>();
    sessions->add(kSession, system.spawn<WatcherActor>("watcher", 4096, notes));
    PipelineParts parts;
    parts.seed = 1;
    parts.sessions = sessions;
    parts.metrics = &counter;
    parts.before_encoder = [&system, notes](const tile_scheduler::StreamFormat& format,
                                            const runtime::Ref<encoder::Inbox>& encoder) {
      return format.layer == StreamLayer::kShared ? system.spawn<TapActor>("tap", 64, notes, encoder) : encoder;
    };
    const auto pipeline = spawn_pipeline(system, with_store, options.config, std::move(parts));
    notes->begin();
    pipeline.scheduler.tell(tile_scheduler::SessionOpened(kSession, format_of(options, with_store),
                                                          static_cast<float>(options.config.accuracy.target)));
    watch(options, pipeline.scheduler, *notes, ended);
    const auto late = system.shutdown(std::chrono::minutes(1));
    if (!late.empty()) return fail("run: " + late.front() + " does not stop");
  }
  if (const auto failure = notes->failure(); !failure.empty()) return fail("run: " + failure);
  Recording made = notes->take();
  made.seconds = ended.seconds;
  made.finished = ended.finished;
  made.stopped = ended.stopped;
  made.disturbed = ended.disturbed;
  const auto too_late = [&](const auto& entry) { return entry.seconds > options.seconds; };
  std::erase_if(made.frames, too_late);
  std::erase_if(made.coarse, too_late);
  return made;
}

}  // namespace darm::accuracy
