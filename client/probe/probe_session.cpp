#include "client/probe/probe_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace darm::client::probe {
namespace {

using std::chrono::milliseconds;

constexpr std::int64_t kKeyRequestEveryUs = 500'000;

double ms(std::int64_t from, std::int64_t to) { return static_cast<double>(to - from) / 1000.0; }

// All state of a session under way.
class Run {
 public:
  Run(const SessionPlan& plan, const Reference* reference) : plan_(plan), reference_(reference) {}

  Result<SessionReport> execute(unsigned bench_draws);

 private:
  [[nodiscard]] double elapsed() const { return static_cast<double>(now_us() - start_us_) / 1e6; }
  [[nodiscard]] View view_now() const;
  [[nodiscard]] bool finished() const;
  Result<void> step();
  Result<void> send_due();
  Result<void> handle(const Received& message);
  Result<void> begin_scene(const wire::SceneManifest& manifest);
  Result<void> handle_frame(const Received& message);
  Result<void> handle_view_frame(const Received& message);
  void note_answer(std::uint64_t answers, const wire::Stamps& stamps, std::int64_t at_us);
  Result<void> draw_if_due();
  Result<void> draw();
  Result<void> note_series();
  Result<void> finish(unsigned bench_draws);
  std::string not_ready() const;
  void count_bytes(const Received& message);
  [[nodiscard]] bool has_view() const;
  [[nodiscard]] Milestone milestone() const;
  Result<void> draw_first_picture();

  const SessionPlan& plan_;
  const Reference* reference_;
  SessionReport report_;
  std::unordered_map<std::uint16_t, std::string> kept_pixels_;  // newest lossless bytes of each slot
  std::unique_ptr<Connection> connection_;
  StreamShape shape_, view_shape_;
  std::optional<SceneModel> scene_;
  std::optional<StreamPlayer> player_;
  std::optional<StreamPlayer> view_player_;  // of the private layer, if there is one
  std::unique_ptr<GlesRenderer> renderer_;
  std::int64_t start_us_ = 0, next_send_us_ = 0, first_image_us_ = 0, last_key_request_us_ = 0;
  std::int64_t decode_us_ = 0, draw_us_ = 0;
  std::uint64_t newest_answer_ = 0, reported_frame_ = 0;
  ByteCounts bytes_;
  LagLog lag_;
  std::size_t next_draw_ = 0;
  bool picture_new_ = false;  // something came since the last draw
  bool first_picture_drawn_ = false;
};

View Run::view_now() const {
  const double t = first_image_us_ > 0 ? static_cast<double>(now_us() - first_image_us_) / 1e6 : 0.0;
  return to_view(camera_at(plan_.path, plan_.path.front().t + t), plan_.width, plan_.height);
}

bool Run::finished() const {
  const bool walking = plan_.path.size() > 1;
  if (first_image_us_ == 0) return elapsed() >= plan_.seconds + (walking ? 60 : 0);
  const double since = walking ? static_cast<double>(now_us() - first_image_us_) / 1e6 : elapsed();
  if (since >= plan_.seconds) return true;
  return plan_.until_error && report_.frames > 0 && report_.answers > 0 && report_.error &&
         *report_.error <= *plan_.until_error;
}

Result<void> Run::begin_scene(const wire::SceneManifest& manifest) {
  if (scene_) return fail("server: a second manifest");
  auto scene = SceneModel::from_manifest(manifest);
  if (!scene) return std::unexpected(scene.error());
  scene_.emplace(std::move(*scene));
  auto player = StreamPlayer::create(*scene_, shape_);
  if (!player) return std::unexpected(player.error());
  player_.emplace(std::move(*player));
  if (view_shape_.phystex_size > 0) {
    auto own = StreamPlayer::create(*scene_, view_shape_);
    if (!own) return std::unexpected(own.error());
    view_player_.emplace(std::move(*own));
  }
  auto renderer = GlesRenderer::create(*scene_, shape_);
  if (!renderer) return std::unexpected(renderer.error());
  renderer_ = std::move(*renderer);
  report_.device = renderer_->device();
  return {};
}

// Where the time went, from the stamps; "total" is measured by our clock alone and is the sum of the stages.
void Run::note_answer(std::uint64_t answers, const wire::Stamps& s, std::int64_t at_us) {
  if (answers == 0 || answers <= newest_answer_) return;
  newest_answer_ = answers;
  ++report_.answers;
  if (s.client_sent() <= 0 || s.sent() < s.camera_received() || s.camera_received() <= 0) return;
  auto& l = report_.latency_ms;
  l["total"].push_back(ms(s.client_sent(), at_us));
  l["network"].push_back(ms(s.client_sent(), at_us) - ms(s.camera_received(), s.sent()));
  const std::pair<const char*, std::int64_t> stages[] = {{"wait", s.view_started()},
                                                         {"visibility", s.view_ready()},
                                                         {"schedule", s.composed()},
                                                         {"encode_wait", s.encode_started()},
                                                         {"compose", s.picture_composed()},
                                                         {"encode", s.encoded()},
                                                         {"send", s.sent()}};
  std::int64_t before = s.camera_received();
  for (const auto& [name, at] : stages) {
    if (at <= 0) continue;  // a NoChange passes no encoder
    l[name].push_back(ms(before, at));
    before = at;
  }
}

Result<void> Run::handle_frame(const Received& message) {
  const auto& frame = message.envelope.frame();
  if (!player_) return fail("server: a frame before the manifest");
  report_.stream_bytes += message.bytes;
  if (first_image_us_ > 0) report_.stream_bytes_after_first_image += message.bytes;
  const std::int64_t before = now_us();
  const auto fate = player_->apply(frame, *scene_);
  if (!fate) return std::unexpected(fate.error());
  const std::int64_t decoded = now_us();
  decode_us_ = decoded - before;
  if (*fate == FrameFate::kApplied) {
    if (plan_.keep_tiles) {
      for (const auto& pixels : frame.pixels()) kept_pixels_[static_cast<std::uint16_t>(pixels.slot())] = pixels.rgb();
    }
    ++report_.frames;
    report_.key_frames += frame.key() ? 1 : 0;
    report_.error = frame.error();
    report_.resolution_error = frame.resolution_error();
    report_.omitted_error = frame.omitted_error();
    report_.latency_ms["decode"].push_back(static_cast<double>(decode_us_) / 1000.0);
    note_answer(frame.answers(), frame.stamps(), message.at_us);
    if (plan_.lag) lag_.picture_decoded(frame.answers(), frame.stamps(), {message.at_us, before, decoded});
    picture_new_ = true;
  }
  return {};
}

Result<void> Run::handle_view_frame(const Received& message) {
  if (!view_player_) return fail("server: a frame of a private layer that was not agreed on");
  report_.view_bytes += message.bytes;
  const auto fate = view_player_->apply(message.envelope.view_frame(), *scene_);
  if (!fate) return std::unexpected(fate.error());
  if (*fate == FrameFate::kApplied) {
    ++report_.view_frames;
    picture_new_ = true;
  }
  return {};
}

void Run::count_bytes(const Received& message) {
  const auto& e = message.envelope;
  bytes_.total = message.bytes_total;
  if (e.has_manifest()) bytes_.manifest += message.bytes;
  if (e.has_geometry()) bytes_.geometry += message.bytes;
  if (e.has_coarse()) bytes_.coarse += message.bytes;
  if (!e.has_frame() && !e.has_view_frame()) return;
  const auto& frame = e.has_frame() ? e.frame() : e.view_frame();
  std::uint64_t edits = 0;
  for (const auto& edit : frame.page_edits()) edits += edit.ByteSizeLong() + 2;  // tag and length
  bytes_.page_table += edits;
  bytes_.video += message.bytes - std::min<std::uint64_t>(edits, message.bytes);
}

Milestone Run::milestone() const { return {elapsed(), bytes_, scene_->chunks().size()}; }

Result<void> Run::handle(const Received& message) {
  count_bytes(message);
  const auto& e = message.envelope;
  switch (e.body_case()) {
    case wire::Envelope::kManifest:
      return begin_scene(e.manifest());
    case wire::Envelope::kGeometry:
      picture_new_ = true;
      return scene_ ? scene_->add_chunk(e.geometry()) : fail("server: geometry before the manifest");
    case wire::Envelope::kCoarse:
      picture_new_ = true;
      if (first_image_us_ > 0) report_.stream_bytes_after_first_image += message.bytes;
      return player_ ? player_->apply(e.coarse(), *scene_) : fail("server: CoarseTex before the manifest");
    case wire::Envelope::kFrame:
      return handle_frame(message);
    case wire::Envelope::kViewFrame:
      return handle_view_frame(message);
    case wire::Envelope::kNoChange:
      ++report_.no_changes;
      report_.stream_bytes += message.bytes;
      if (first_image_us_ > 0) report_.stream_bytes_after_first_image += message.bytes;
      report_.error = e.no_change().error();
      report_.resolution_error = e.no_change().resolution_error();
      report_.omitted_error = e.no_change().omitted_error();
      note_answer(e.no_change().answers(), e.no_change().stamps(), message.at_us);
      lag_.no_change(e.no_change().answers());
      return {};
    default:
      return {};  // a newer server may say more
  }
}

Result<void> Run::send_due() {
  const std::int64_t now = now_us();
  const auto lost = [](const auto& player) {
    return player && player->key_frame_wanted() && player->frames_lost() > 0;
  };
  if ((lost(player_) || lost(view_player_)) && now - last_key_request_us_ > kKeyRequestEveryUs) {
    wire::Feedback feedback;
    feedback.set_key_frame_wanted(lost(player_));
    feedback.set_view_key_frame_wanted(lost(view_player_));
    feedback.set_frame_shown(player_->frame_shown());
    feedback.set_frames_lost(player_->frames_lost());
    feedback.set_client_time_us(now);
    last_key_request_us_ = now;
    if (auto ok = connection_->send_feedback(feedback); !ok) return ok;
  }
  if (now < next_send_us_) return {};
  const auto period = static_cast<std::int64_t>(1e6 / plan_.updates_per_second);
  next_send_us_ = std::max(next_send_us_ + period, now - period);
  const auto sent = connection_->send_camera(view_now());
  if (!sent) return std::unexpected(sent.error());
  if (plan_.lag) lag_.camera_sent(*sent, now);
  ++report_.cameras;
  if (player_ && player_->frame_shown() != reported_frame_) {
    wire::Feedback feedback;
    reported_frame_ = player_->frame_shown();
    feedback.set_frame_shown(reported_frame_);
    feedback.set_frames_lost(player_->frames_lost());
    feedback.set_client_time_us(now);
    feedback.set_decode_us(decode_us_);
    feedback.set_draw_us(draw_us_);
    return connection_->send_feedback(feedback);
  }
  return {};
}

Result<void> Run::draw() {
  if (auto ok = renderer_->synchronise(*scene_, *player_); !ok) return ok;
  if (view_player_) {
    if (auto ok = renderer_->synchronise_view(*scene_, *view_player_); !ok) return ok;
  }
  const std::int64_t before = now_us();
  if (auto ok = renderer_->draw(*scene_, view_now()); !ok) return ok;
  renderer_->finish();
  const std::int64_t drawn = now_us();
  draw_us_ = drawn - before;
  lag_.drawn(drawn);
  report_.draw_seconds.push_back(static_cast<double>(draw_us_) / 1e6);
  picture_new_ = false;
  return {};
}

Result<void> Run::note_series() {
  SeriesPoint point{elapsed(), std::nullopt, report_.error, report_.resolution_error, report_.omitted_error};
  if (reference_ != nullptr) {
    const auto picture = renderer_->read_picture();
    if (!picture) return std::unexpected(picture.error());
    const auto score = compare(*picture, *reference_);
    if (!score) return std::unexpected(score.error());
    point.psnr = score->psnr;
  }
  report_.series.push_back(point);
  return {};
}

// All geometry that the first view can see.
bool Run::has_view() const {
  return scene_ && (scene_->complete() || scene_->chunks().size() >= connection_->welcome().chunks_in_view());
}

// CoarseTex covers every surface: the picture is complete without a single frame.
Result<void> Run::draw_first_picture() {
  if (auto ok = draw(); !ok) return ok;
  report_.first_picture = milestone();
  first_picture_drawn_ = true;
  if (!plan_.check_first) return {};
  const auto counts = renderer_->count_residency(*scene_, view_now());
  if (!counts) return std::unexpected(counts.error());
  report_.first_background = static_cast<double>(counts->background) / static_cast<double>(counts->samples);
  return {};
}

// The first picture and the first full image as soon as they can be, then the points of the series.
Result<void> Run::draw_if_due() {
  if (!has_view() || !player_->has_coarse()) return {};
  if (!first_picture_drawn_) {
    if (auto ok = draw_first_picture(); !ok) return ok;
    if (report_.frames > 0) picture_new_ = true;  // the frame of it is looked at below
  }
  if (first_image_us_ == 0) {
    if (!picture_new_ || report_.frames == 0) return {};  // CoarseTex alone is not what the server has to show
    if (auto ok = draw(); !ok) return ok;
    const auto drawn = milestone();
    const auto counts = renderer_->count_residency(*scene_, view_now());
    if (!counts) return std::unexpected(counts.error());
    if (counts->undefined > 0) return {};
    first_image_us_ = now_us();
    report_.first_image = drawn;
    return note_series();
  }
  if (plan_.lag && picture_new_) {
    if (auto ok = draw(); !ok) return ok;
  }
  bool due = false;
  for (; next_draw_ < plan_.draw_times.size() && elapsed() >= plan_.draw_times[next_draw_]; ++next_draw_) due = true;
  if (!due) return {};
  if (auto ok = draw(); !ok) return ok;
  return note_series();
}

Result<void> Run::step() {
  if (auto ok = send_due(); !ok) return ok;
  const auto wait = std::clamp<std::int64_t>((next_send_us_ - now_us()) / 1000, 0, 100);
  auto message = connection_->next(milliseconds(wait));
  if (!message) return std::unexpected(message.error());
  // What has come together is handled together, up to the next camera; all of it where each picture is drawn, or slow
  // drawing would leave ever more waiting.
  while (message->has_value()) {
    if (auto ok = handle(**message); !ok) return ok;
    if (!plan_.lag && now_us() >= next_send_us_) break;
    message = connection_->next(milliseconds(0));
    if (!message) return std::unexpected(message.error());
  }
  return draw_if_due();
}

std::string Run::not_ready() const {
  if (!scene_) return "no scene came";
  if (!has_view()) return fmt::format("{} geometry chunks came, not all", scene_->chunks().size());
  if (!player_->has_coarse()) return "no CoarseTex came";
  return report_.frames == 0 ? "no frame came" : "some pixels had no light";
}

Result<void> Run::finish(unsigned bench_draws) {
  if (first_image_us_ == 0)
    return fail(fmt::format("no full image in {:.1f} s: {}; a slow machine or link needs more --seconds", elapsed(),
                            not_ready()));
  if (auto ok = draw(); !ok) return ok;
  if (auto ok = note_series(); !ok) return ok;
  report_.seconds = elapsed();
  report_.stream_seconds = static_cast<double>(now_us() - first_image_us_) / 1e6;
  report_.bytes = connection_->bytes_received();
  report_.sent_bytes = connection_->bytes_sent();
  report_.frames_lost = player_->frames_lost();
  if (view_player_) {
    report_.view_frames_lost = view_player_->frames_lost();
    report_.view_slots_used = view_player_->pages().resident();
  }
  report_.triangles = scene_->triangles();
  report_.chunks = scene_->chunks().size();
  if (plan_.lag) report_.lag = lag_.samples(connection_->server_clock_ahead().value_or(0));
  auto picture = renderer_->read_picture();
  if (!picture) return std::unexpected(picture.error());
  report_.picture = std::move(*picture);
  const auto counts = renderer_->count_residency(*scene_, view_now());
  if (!counts) return std::unexpected(counts.error());
  report_.residency = *counts;
  if (plan_.keep_tiles) {
    const auto entries = scene_->tile_count();
    report_.tiles = plan_.lossless ? tiles_of(kept_pixels_, player_->pages(), entries)
                                   : tiles_of(player_->picture(), player_->pages(), entries);
  }
  connection_->goodbye();
  if (bench_draws > 0) report_.draw_seconds.clear();
  for (unsigned i = 0; i < bench_draws; ++i) {
    if (auto ok = draw(); !ok) return ok;
  }
  return {};
}

Result<SessionReport> Run::execute(unsigned bench_draws) {
  start_us_ = next_send_us_ = now_us();
  ConnectOptions options;
  options.host = plan_.host;
  options.port = plan_.port;
  options.tls = plan_.tls;
  options.authority = plan_.authority;
  options.name = "darm-probe";
  options.view = view_now();
  options.max_phystex = plan_.max_phystex;
  options.max_view_phystex = plan_.max_view_phystex;
  options.chroma_444 = plan_.chroma_444;
  options.target_error = static_cast<float>(plan_.target_error);
  options.lossless = plan_.lossless;
  options.udp = plan_.udp;
  options.measure_clock = plan_.lag;
  auto connection = Connection::open(options);
  if (!connection) return std::unexpected(connection.error());
  connection_ = std::move(*connection);
  const auto& welcome = connection_->welcome();
  if (plan_.lossless && !welcome.lossless())
    return fail("server: does not offer lossless streams; its configuration must set stream.allow_lossless");
  shape_ = {welcome.phystex_size(), welcome.chroma_444(), welcome.lossless()};
  view_shape_ = {welcome.view_phystex(), welcome.chroma_444(), welcome.lossless()};
  report_.view_phystex_size = welcome.view_phystex();
  report_.target_error = static_cast<double>(welcome.target_error());
  report_.server = welcome.server();
  report_.udp = connection_->uses_udp();
  report_.phystex_size = welcome.phystex_size();
  while (!finished()) {
    if (auto ok = step(); !ok) return std::unexpected(ok.error());
  }
  if (auto ok = finish(bench_draws); !ok) return std::unexpected(ok.error());
  return std::move(report_);
}

}  // namespace

Result<SessionReport> run_session(const SessionPlan& plan, const Reference* reference, unsigned bench_draws) {
  return Run(plan, reference).execute(bench_draws);
}

}  // namespace darm::client::probe
