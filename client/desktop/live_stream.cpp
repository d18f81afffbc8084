#include "client/desktop/live_stream.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace darm::client::desktop {
namespace {

using std::chrono::milliseconds;

constexpr std::int64_t kKeysEveryUs = 500'000;
constexpr std::int64_t kAgainUs = 250'000;  // a camera without an answer is sent again: datagrams get lost
constexpr milliseconds kLook{8};            // how late a new camera may be noticed
constexpr milliseconds kSilence{12'000};
constexpr std::size_t kMostQueuedBytes = std::size_t{32} << 20;

double now_ms() { return static_cast<double>(now_us()) / 1000; }

bool lost_track(const std::optional<StreamPlayer>& player) {
  return player && player->key_frame_wanted() && player->frames_lost() > 0;
}

Error contradiction(const Error& error) {
  return Error("The server contradicts itself: " + error.message, Cause::kProtocol);
}

}  // namespace

LiveStream::LiveStream(ConnectOptions options, std::function<void()> wake)
    : options_(std::move(options)),
      wake_(std::move(wake)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

LiveStream::~LiveStream() {
  thread_.request_stop();
  thread_.join();
}

// ---- for whoever draws ----

void LiveStream::look(const View& view) {
  const std::lock_guard lock(mutex_);
  wishes_.view = view;
  wishes_.view_new = true;
}

void LiveStream::shown(std::uint64_t frame, std::int64_t draw_us) {
  const std::lock_guard lock(mutex_);
  wishes_.shown_frame = frame;
  wishes_.draw_us = draw_us;
  wishes_.shown_new = true;
}

bool LiveStream::has_arrivals() const {
  const std::lock_guard lock(mutex_);
  return arrived_;
}

Arrivals LiveStream::take() {
  const std::lock_guard lock(mutex_);
  arrived_ = false;
  return std::exchange(arrivals_, {});
}

Answer LiveStream::take_answer() {
  const std::lock_guard lock(mutex_);
  return std::exchange(answer_, {});
}

Traffic LiveStream::traffic() const {
  const std::lock_guard lock(mutex_);
  return traffic_;
}

unsigned LiveStream::joins() const {
  const std::lock_guard lock(mutex_);
  return reunion_.joins();
}

bool LiveStream::connected() const {
  const std::lock_guard lock(mutex_);
  return connected_;
}

void LiveStream::leave() {
  const std::lock_guard lock(mutex_);
  wishes_.away = true;
}

void LiveStream::come_back() {
  const std::lock_guard lock(mutex_);
  wishes_.away = false;
  retry_.notify_all();
}

void LiveStream::pictured() {
  const std::lock_guard lock(mutex_);
  reunion_.pictured();
}

void LiveStream::say(std::string text, double now, double seconds) {
  const std::lock_guard lock(mutex_);
  reunion_.say(std::move(text), now, seconds);
}

Notice LiveStream::words(double now) const {
  const std::lock_guard lock(mutex_);
  return reunion_.words(now);
}

// ---- the stream's thread ----

template <class Change>
void LiveStream::post(Change&& change) {
  {
    const std::lock_guard lock(mutex_);
    std::forward<Change>(change)(arrivals_);
    arrived_ = true;
  }
  wake_();
}

void LiveStream::run(const std::stop_token& stop) {
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  while (!stop.stop_requested()) {
    const Error reason = visit(stop);
    if (stop.stop_requested()) return;
    if (std::exchange(let_go_, false)) {
      wait_for_somebody(stop);
      continue;
    }
    std::unique_lock lock(mutex_);
    connected_ = false;
    const auto wait = reunion_.lost(reason, chance(random_));
    lock.unlock();
    wake_();
    lock.lock();
    const auto never = [] { return false; };
    if (wait) {
      retry_.wait_for(lock, stop, milliseconds(static_cast<int>(*wait)), never);
    } else {
      retry_.wait(lock, stop, never);
    }
  }
}

bool LiveStream::may_let_go() const {
  const std::lock_guard lock(mutex_);
  return wishes_.away && scene_ && scene_->all_read();
}

void LiveStream::wait_for_somebody(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  connected_ = false;
  reunion_.left();
  retry_.wait(lock, stop, [this] { return !wishes_.away; });
}

// One session from Hello to its end, which is told.
Error LiveStream::visit(const std::stop_token& stop) {
  ConnectOptions options = options_;
  options.stop = stop;
  options.silence_timeout = kSilence;
  options.max_queued_bytes = kMostQueuedBytes;
  options.known_scene = scene_ && scene_->all_read() ? scene_->tag() : 0;
  {
    const std::lock_guard lock(mutex_);
    if (wishes_.view) options.view = wishes_.view;
  }
  auto opened = Connection::open(options);
  if (!opened) return opened.error();
  Connection& connection = **opened;
  if (auto ok = join(connection.welcome()); !ok) return contradiction(ok.error());
  while (!stop.stop_requested()) {
    let_go_ = may_let_go();
    if (let_go_) return Error("nobody looks");
    if (auto ok = send_due(connection); !ok) return ok.error();
    auto message = connection.next(kLook);
    while (message && *message && !stop.stop_requested()) {  // what has come together, but no camera waits for it
      if (auto ok = handle(**message); !ok) return contradiction(ok.error());
      if (auto ok = send_due(connection); !ok) return ok.error();
      message = connection.next(milliseconds(0));
    }
    if (!message) return message.error();
  }
  return Error("stopped");
}

Result<void> LiveStream::join(const wire::Welcome& welcome) {
  if (welcome.lossless() || welcome.phystex_size() > options_.max_phystex)
    return fail("a PhysTex that was not asked for");
  const bool known = welcome.scene_known();
  if (known && !(scene_ && scene_->all_read())) return fail("a scene is taken for known that was not named");
  shape_ = {welcome.phystex_size(), welcome.chroma_444(), false};
  view_shape_.reset();
  if (welcome.view_phystex() > 0) view_shape_ = StreamShape{welcome.view_phystex(), welcome.chroma_444(), false};
  camera_every_us_ =
      static_cast<std::int64_t>(1e6 / std::clamp(2.0 * static_cast<double>(welcome.updates_per_second()), 5.0, 60.0));
  sequence_ = answered_ = 0;
  camera_sent_us_ = 0;
  player_.reset();
  view_player_.reset();
  Joined joined;
  joined.shape = shape_;
  joined.view_shape = view_shape_;
  if (!from_pose(welcome.start(), joined.start)) joined.start = View{};
  post([&](Arrivals& a) {
    // Of the streams that have ended nothing counts any more; CoarseTex is the scene's.
    auto coarse = std::move(a.shared.coarse);
    a.shared = {};
    a.shared.coarse = std::move(coarse);
    a.view = {};
    a.joined = joined;
    reunion_.joined(now_ms());
    connected_ = true;
    wishes_.view_new = true;
  });
  return known ? make_players() : Result<void>();
}

Result<void> LiveStream::make_players() {
  auto player = StreamPlayer::create(*scene_, shape_);
  if (!player) return std::unexpected(player.error());
  player_.emplace(std::move(*player));
  view_player_.reset();
  if (!view_shape_) return {};
  auto own = StreamPlayer::create(*scene_, *view_shape_);
  if (!own) return std::unexpected(own.error());
  view_player_.emplace(std::move(*own));
  return {};
}

Result<void> LiveStream::begin_scene(const wire::SceneManifest& manifest) {
  auto scene = SceneModel::from_manifest(manifest);
  if (!scene) return std::unexpected(scene.error());
  scene_.emplace(std::move(*scene));
  if (auto ok = make_players(); !ok) return ok;
  auto copy = std::make_unique<SceneModel>(*scene_);
  post([&](Arrivals& a) {
    a.scene = std::move(copy);
    a.scene_name = manifest.name();
    a.chunks.clear();
    a.shared = {};
    a.view = {};
  });
  return {};
}

void LiveStream::note_answer(const Errors& errors, std::uint64_t answers) {
  answered_ = std::max(answered_, answers);
  const auto sound = [](float e) { return e >= 0 && std::isfinite(e); };
  if (sound(errors.light)) answer_.error = double{errors.light};
  if (sound(errors.resolution)) answer_.resolution_error = double{errors.resolution};
  if (sound(errors.omitted)) answer_.omitted_error = double{errors.omitted};
}

Result<void> LiveStream::handle_frame(const Received& message) {
  const wire::StreamFrame& frame = message.envelope.frame();
  if (!player_) return fail("a frame before the manifest");
  const std::int64_t before = now_us();
  const auto fate = player_->apply(frame, *scene_);
  if (!fate) return std::unexpected(fate.error());
  if (*fate != FrameFate::kApplied) {
    const std::lock_guard lock(mutex_);
    ++traffic_.frames_lost;
    return {};
  }
  decode_us_ = now_us() - before;
  auto news = player_->take_news();
  post([&](Arrivals& a) {
    a.shared.add(std::move(news));
    a.frame = frame.frame();
    if (a.decode_ms.size() < 1000) a.decode_ms.push_back(static_cast<double>(decode_us_) / 1000);
    a.answers_us = std::max(a.answers_us, frame.stamps().client_sent());
    note_answer({frame.error(), frame.resolution_error(), frame.omitted_error()}, frame.answers());
  });
  return {};
}

Result<void> LiveStream::handle_view_frame(const wire::StreamFrame& frame) {
  if (!view_player_) return fail("a frame of a private layer that was not agreed on");
  const auto fate = view_player_->apply(frame, *scene_);
  if (!fate) return std::unexpected(fate.error());
  if (*fate != FrameFate::kApplied) return {};
  auto news = view_player_->take_news();
  post([&](Arrivals& a) { a.view.add(std::move(news)); });
  return {};
}

Result<void> LiveStream::handle(const Received& message) {
  const auto& e = message.envelope;
  {
    const std::lock_guard lock(mutex_);
    traffic_.received += message.bytes;
    if (e.has_frame() || e.has_view_frame() || e.has_coarse() || e.has_no_change()) traffic_.stream += message.bytes;
  }
  switch (e.body_case()) {
    case wire::Envelope::kManifest:
      return begin_scene(e.manifest());
    case wire::Envelope::kGeometry: {
      if (!scene_) return fail("geometry before the manifest");
      auto chunk = scene_->read_chunk(e.geometry());
      if (!chunk) return std::unexpected(chunk.error());
      post([&](Arrivals& a) { a.chunks.push_back(std::move(*chunk)); });
      return {};
    }
    case wire::Envelope::kCoarse: {
      if (!player_) return fail("CoarseTex before the manifest");
      if (auto ok = player_->apply(e.coarse(), *scene_); !ok) return ok;
      auto news = player_->take_news();
      post([&](Arrivals& a) { a.shared.add(std::move(news)); });
      return {};
    }
    case wire::Envelope::kFrame:
      return handle_frame(message);
    case wire::Envelope::kViewFrame:
      return handle_view_frame(e.view_frame());
    case wire::Envelope::kNoChange: {
      const std::lock_guard lock(mutex_);
      const auto& answer = e.no_change();
      note_answer({answer.error(), answer.resolution_error(), answer.omitted_error()}, answer.answers());
      const std::int64_t sent = e.no_change().stamps().client_sent();
      if (sent > 0) answer_.lag_ms = static_cast<double>(message.at_us - sent) / 1000;
      return {};
    }
    default:
      return {};  // a newer server may say more
  }
}

Result<void> LiveStream::ask_for_keys(Connection& connection, std::int64_t now) {
  if ((!lost_track(player_) && !lost_track(view_player_)) || now - keys_asked_us_ < kKeysEveryUs) return {};
  keys_asked_us_ = now;
  wire::Feedback feedback;
  feedback.set_key_frame_wanted(lost_track(player_));
  feedback.set_view_key_frame_wanted(lost_track(view_player_));
  if (player_) {
    feedback.set_frame_shown(player_->frame_shown());
    feedback.set_frames_lost(player_->frames_lost());
  }
  feedback.set_client_time_us(now);
  return connection.send_feedback(feedback);
}

Result<void> LiveStream::send_due(Connection& connection) {
  const std::int64_t now = now_us();
  if (auto ok = ask_for_keys(connection, now); !ok) return ok;
  std::optional<View> view;
  std::optional<wire::Feedback> feedback;
  {
    const std::lock_guard lock(mutex_);
    const std::int64_t since = now - camera_sent_us_;
    const bool again = answered_ < sequence_ && since >= kAgainUs;
    if (wishes_.view && (again || (wishes_.view_new && since >= camera_every_us_))) {
      view = wishes_.view;
      wishes_.view_new = false;
    }
    if (std::exchange(wishes_.shown_new, false)) {
      feedback.emplace();
      feedback->set_frame_shown(wishes_.shown_frame);
      feedback->set_frames_lost(player_ ? player_->frames_lost() : 0);
      feedback->set_client_time_us(now);
      feedback->set_decode_us(decode_us_);
      feedback->set_draw_us(wishes_.draw_us);
    }
  }
  if (view) {
    camera_sent_us_ = now;
    const auto sent = connection.send_camera(*view);
    if (!sent) return std::unexpected(sent.error());
    sequence_ = *sent;
  }
  if (feedback) return connection.send_feedback(*feedback);
  return {};
}

}  // namespace darm::client::desktop
