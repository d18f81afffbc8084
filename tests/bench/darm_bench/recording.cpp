#include "tests/bench/darm_bench/recording.hpp"

#include <algorithm>
#include <cmath>

#include "client/core/renderer_gles.hpp"
#include "client/core/stream_player.hpp"

namespace darm::bench {

using namespace client;

Result<Recording> record(std::uint16_t port, const View& view, double seconds, Stream stream) {
  ConnectOptions options;
  options.host = "127.0.0.1";
  options.port = port;
  options.name = "darm-bench";
  options.max_view_phystex = 0;  // the reference is light that does not depend on the eye
  options.lossless = stream == Stream::kLossless;
  options.max_phystex = options.lossless ? 8192 : 4096;  // the set-up's `stream.phystex` decides
  auto connection = Connection::open(options);
  if (!connection) return std::unexpected(connection.error());
  Recording out;
  out.view = view;
  out.welcome = (*connection)->welcome();
  out.start_us = now_us();
  std::int64_t next_camera = out.start_us;
  while (now_us() - out.start_us < static_cast<std::int64_t>(seconds * 1e6)) {
    if (now_us() >= next_camera) {
      if (auto sent = (*connection)->send_camera(view); !sent) return std::unexpected(sent.error());
      next_camera += 100'000;
    }
    auto message = (*connection)->next(std::chrono::milliseconds(20));
    if (!message) return std::unexpected(message.error());
    if (message->has_value()) out.messages.push_back(std::move(**message));
  }
  (*connection)->goodbye();
  return out;
}

namespace {

// The client's state while a recording is played into it.
class Player {
 public:
  explicit Player(const Recording& recording) : recording_(recording) {
    const auto& w = recording.welcome;
    shape_ = {w.phystex_size(), w.chroma_444(), w.lossless()};
  }

  /// True if the picture may have changed.
  Result<bool> apply(const wire::Envelope& e) {
    if (e.has_manifest()) {
      auto scene = SceneModel::from_manifest(e.manifest());
      if (!scene) return std::unexpected(scene.error());
      scene_.emplace(std::move(*scene));
      auto player = StreamPlayer::create(*scene_, shape_);
      if (!player) return std::unexpected(player.error());
      player_.emplace(std::move(*player));
      auto renderer = GlesRenderer::create(*scene_, shape_);
      if (!renderer) return std::unexpected(renderer.error());
      renderer_ = std::move(*renderer);
      return false;
    }
    if (!scene_) return false;
    if (e.has_geometry()) return changed(scene_->add_chunk(e.geometry()));
    if (e.has_coarse()) return changed(player_->apply(e.coarse(), *scene_));
    if (e.has_no_change()) estimate_ = e.no_change().error();
    if (!e.has_frame()) return false;
    const auto fate = player_->apply(e.frame(), *scene_);
    if (!fate) return std::unexpected(fate.error());
    estimate_ = e.frame().error();
    framed_ = framed_ || *fate == FrameFate::kApplied;
    return *fate == FrameFate::kApplied;
  }

  /// nullopt: there is no full picture yet.
  Result<std::optional<SeriesPoint>> draw(double t, const Reference& reference) {
    if (!scene_ || !scene_->complete() || !player_->has_coarse()) return std::nullopt;
    if (auto ok = renderer_->synchronise(*scene_, *player_); !ok) return std::unexpected(ok.error());
    if (auto ok = renderer_->draw(*scene_, recording_.view); !ok) return std::unexpected(ok.error());
    const auto picture = renderer_->read_picture();
    if (!picture) return std::unexpected(picture.error());
    const auto score = compare(*picture, reference);
    if (!score) return std::unexpected(score.error());
    pictures_.push_back(std::move(*picture));
    return SeriesPoint{t, score->psnr, score->mssim, framed_ ? estimate_ : 1.0};
  }

  void compare_to(const Image8* truth, std::vector<SeriesPoint>& series) const {
    for (std::size_t i = 0; i < series.size() && i < pictures_.size(); ++i)
      series[i].to_truth = display_rms(pictures_[i], truth != nullptr ? *truth : pictures_.back());
  }
  Image8 take_last() { return pictures_.empty() ? Image8{} : std::move(pictures_.back()); }

 private:
  static Result<bool> changed(const Result<void>& done) {
    if (!done) return std::unexpected(done.error());
    return true;
  }

  const Recording& recording_;
  StreamShape shape_;
  std::optional<SceneModel> scene_;
  std::optional<StreamPlayer> player_;
  std::unique_ptr<GlesRenderer> renderer_;
  std::vector<Image8> pictures_;  // one a point
  double estimate_ = 1;
  bool framed_ = false;
};

}  // namespace

double display_rms(const Image8& a, const Image8& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.rgb.size(); ++k) {
    const double d = (double(a.rgb[k]) - double(b.rgb[k])) / 255.0;
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(a.rgb.size(), 1)));
}

Result<Replayed> replay(const Recording& recording, const Reference& reference, double target, const Image8* truth) {
  std::vector<SeriesPoint> series;
  Player player(recording);
  bool stale = false;
  double drawn_at = 0;
  for (std::size_t i = 0; i < recording.messages.size(); ++i) {
    const auto& message = recording.messages[i];
    const double t = static_cast<double>(message.at_us - recording.start_us) * 1e-6;
    const auto changed = player.apply(message.envelope);
    if (!changed) return std::unexpected(changed.error());
    stale = stale || *changed;
    const bool last = i + 1 == recording.messages.size();
    const double step = !series.empty() && series.back().psnr >= target ? 1.25 : 1.04;
    if (!stale || (!last && t < drawn_at * step)) continue;
    auto point = player.draw(t, reference);
    if (!point) return std::unexpected(point.error());
    if (!*point) continue;
    series.push_back(**point);
    drawn_at = t;
    stale = false;
  }
  player.compare_to(truth, series);
  return Replayed{std::move(series), player.take_last()};
}

std::optional<double> time_to(const std::vector<SeriesPoint>& series, double target) {
  std::optional<double> at;
  for (const auto& point : series) {
    if (point.psnr < target)
      at.reset();
    else if (!at)
      at = point.t;
  }
  return at;
}

}  // namespace darm::bench
