#include "client/desktop/viewer.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <future>
#include <iostream>
#include <memory>
#include <utility>

#include "client/core/picture_files.hpp"
#include "client/desktop/controls.hpp"
#include "client/desktop/frame_guard.hpp"
#include "client/desktop/live_stream.hpp"
#include "client/desktop/overlay.hpp"
#include "client/desktop/pick.hpp"
#include "client/desktop/redraw.hpp"
#include "client/desktop/rig.hpp"
#include "client/desktop/stage.hpp"
#include "client/desktop/view_link.hpp"

namespace darm::client::desktop {
namespace {

constexpr double kPanelEveryMs = 500;
constexpr double kLongestWaitMs = 250;
constexpr double kLeaveAfterMs = 10'000;       // long enough that looking something up costs nobody a new session
constexpr double kRefineAfterMs = 50;          // how often it is asked whether a view drawn coarsely has come to rest
constexpr std::uint32_t kCountCoarseness = 8;  // residency is counted on one sample for so many pixels on a side

double now_ms() { return static_cast<double>(now_us()) / 1000; }

std::string picture_name() { return fmt::format("darm-{:%Y%m%d-%H%M%S}.png", fmt::localtime(std::time(nullptr))); }

class Viewer {
 public:
  Viewer(const VisitPlan& plan, std::unique_ptr<Window> window)
      : plan_(plan), window_(std::move(window)), rig_(plan.view.value_or(UprightView{}), Bounds{}) {}

  Result<void> run();

 private:
  void watch_presence();
  void move(double since, bool rested);
  Result<void> take_arrivals();
  void take_answer();
  void note_lag(double ms);
  void follow(const Arrivals& arrivals);
  void enter(const SceneModel& scene, std::string name);
  void go_to_start();
  Result<void> draw(std::uint32_t divisor);
  Result<void> draw_if_due();
  void note_drawn(double begin, double end, std::uint32_t divisor);
  [[nodiscard]] bool refinable(double now) const { return drawn_divisor_ > 1 && !pace_.moving(now); }
  Result<void> present();
  Result<void> refresh_panel();
  void obey(Action action);
  void save_picture();
  Result<void> leave();
  [[nodiscard]] Result<void> nothing_seen() const;
  Result<void> report();
  [[nodiscard]] double patience() const;
  [[nodiscard]] bool time_over() const { return plan_.seconds && now_ms() - start_ms_ >= *plan_.seconds * 1000; }
  [[nodiscard]] View view() const { return to_view(rig_.view, size_.width, size_.height); }

  const VisitPlan& plan_;
  std::unique_ptr<Window> window_;
  Rig rig_;
  Stage stage_;
  std::unique_ptr<Controls> controls_;
  std::unique_ptr<Overlay> overlay_;
  std::unique_ptr<LiveStream> stream_;
  RedrawPace pace_;
  FrameGuard guard_;
  std::uint32_t drawn_divisor_ = 1;  // of the picture that is there
  OverlayShow show_;
  PixelSize size_;
  std::future<std::string> saving_;  // what there is to say of a picture once it is written

  const double start_ms_ = now_ms();
  double last_step_ms_ = start_ms_, panel_ms_ = 0, whole_ms_ = 0, hidden_ms_ = 0;
  bool placed_ = false;  // by the plan or by hand: the server's start does not move it
  bool camera_new_ = true, drew_ = false;
  UprightView start_;                      // where the server's scene is entered
  std::optional<std::string> scene_name_;  // none: no scene has come yet
  std::int64_t answers_us_ = 0;
  std::uint64_t frame_ = 0, counted_bytes_ = 0;
  VisitFigures figures_;
  Measured measured_;
  Rate frames_{1000}, stream_bytes_{4000};
};

Result<void> Viewer::run() {
  placed_ = plan_.view.has_value();
  show_.panel = plan_.panel;
  show_.bare = plan_.bare;
  controls_ = std::make_unique<Controls>(window_->handle(), rig_, [this](double x, double y) {
    return stage_.scene() != nullptr ? point_under(*stage_.scene(), rig_.view, x, y) : std::nullopt;
  });
  auto overlay = Overlay::create(*window_);
  if (!overlay) return std::unexpected(overlay.error());
  overlay_ = std::move(*overlay);
  size_ = window_->pixels();
  ConnectOptions server = plan_.server;
  if (placed_) server.view = view();
  stream_ = std::make_unique<LiveStream>(std::move(server), &Window::wake);
  while (!window_->closing() && !time_over()) {
    const double pause = patience();
    window_->wait(pause);
    move(std::exchange(last_step_ms_, now_ms()), pause > 0);
    watch_presence();
    if (auto ok = draw_if_due(); !ok) return ok;
    if (auto ok = present(); !ok) return ok;
  }
  return leave();
}

// How long the loop may sleep.
double Viewer::patience() const {
  const double now = now_ms();
  double wait = controls_->restless() || plan_.turn != 0 ? 0 : kLongestWaitMs;
  if (size_.width == 0) return kLongestWaitMs;  // iconified: nothing is drawn
  wait = std::min(wait, pace_.wait(now));
  if (drawn_divisor_ > 1) wait = std::min(wait, kRefineAfterMs);
  if (show_.panel && !show_.bare) wait = std::min(wait, panel_ms_ + kPanelEveryMs - now);
  return wait;
}

// Nobody looks at an iconified window: after a while it lets its session go.
void Viewer::watch_presence() {
  const double now = now_ms();
  if (size_.width > 0) {
    if (std::exchange(hidden_ms_, 0) > 0) stream_->come_back();
  } else if (hidden_ms_ == 0) {
    hidden_ms_ = now;
  } else if (now - hidden_ms_ >= kLeaveAfterMs) {
    stream_->leave();
  }
}

void Viewer::move(double since, bool rested) {
  const double now = now_ms();
  for (const Action action : controls_->take_actions()) obey(action);
  bool moved = controls_->advance(step_seconds(now - since, rested), overlay_->takes_mouse());
  if (plan_.turn != 0 && stage_.ready()) {
    const double yaw = plan_.turn * kDegree * (now - since) / 1000;
    rig_.mode == Mode::kOrbit ? rig_.orbit(yaw, 0) : rig_.look(yaw, 0);
    moved = true;
  }
  if (const PixelSize size = window_->pixels(); !(size == size_)) {
    size_ = size;
    camera_new_ = true;
    pace_.moved(now);
  }
  if (moved) {
    placed_ = placed_ || stage_.ready();  // whoever cannot wait begins at the start all the same
    camera_new_ = true;
    pace_.moved(now);
  }
  take_answer();
  if (stream_->has_arrivals()) pace_.news();
  if (camera_new_ && size_.width > 0 && (placed_ || stage_.ready())) {
    camera_new_ = false;
    stream_->look(view());
  }
}

void Viewer::take_answer() {
  const Answer answer = stream_->take_answer();
  if (answer.error) measured_.error = answer.error;
  measured_.resolution_error = answer.resolution_error.value_or(measured_.resolution_error);
  measured_.omitted_error = answer.omitted_error.value_or(measured_.omitted_error);
  if (answer.lag_ms) note_lag(*answer.lag_ms);
}

void Viewer::note_lag(double ms) {
  measured_.lag_ms = ms;
  if (whole_ms_ > 0) figures_.lag_ms.add(ms);
}

void Viewer::follow(const Arrivals& a) {
  if (a.joined) {
    answers_us_ = 0;
    start_ = upright(a.joined->start);
  }
  if (a.joined && !placed_) {
    rig_.view = start_;
    camera_new_ = true;
  }
  answers_us_ = std::max(answers_us_, a.answers_us);
  if (a.frame > 0) frame_ = a.frame;
  for (const double ms : a.decode_ms) figures_.decode_ms.add(ms);
  figures_.stream_frames += a.decode_ms.size();
}

void Viewer::go_to_start() {
  rig_.stop();
  rig_.view = start_;
  camera_new_ = true;
  pace_.moved(now_ms());
}

// A scene has come. One that was watched before keeps the hand where it was; in another one that is no place.
void Viewer::enter(const SceneModel& scene, std::string name) {
  const bool same = scene_name_ == name;
  const bool other = scene_name_ && !same;
  scene_name_ = std::move(name);
  if (other) {
    go_to_start();
    stream_->say("Another scene is shown here now.", now_ms(), 5);
  }
  const auto mode = rig_.mode;
  const auto pivot = rig_.pivot;
  rig_.set_bounds({scene.origin() + glm::dvec3(scene.low()), scene.origin() + glm::dvec3(scene.high())});
  if (!same) return;
  rig_.mode = mode;
  rig_.pivot = pivot;
}

Result<void> Viewer::take_arrivals() {
  if (!stream_->has_arrivals()) return {};
  Arrivals arrivals = stream_->take();
  follow(arrivals);
  const bool new_scene = arrivals.scene != nullptr;
  std::string name = std::move(arrivals.scene_name);
  const double before = now_ms();
  const auto uploaded = stage_.take(std::move(arrivals));
  if (!uploaded) return std::unexpected(uploaded.error());
  if (*uploaded) figures_.upload_ms.add(now_ms() - before);
  if (new_scene && stage_.scene() != nullptr) enter(*stage_.scene(), std::move(name));
  if (camera_new_ && size_.width > 0) {
    camera_new_ = false;
    stream_->look(view());
  }
  return {};
}

Result<void> Viewer::draw(std::uint32_t divisor) {
  if (auto ok = take_arrivals(); !ok) return ok;
  const double begin = now_ms();
  const auto side = [divisor](std::uint32_t pixels) { return std::max(1u, pixels / divisor); };
  if (auto ok = stage_.draw(to_view(rig_.view, side(size_.width), side(size_.height))); !ok) return ok;
  note_drawn(begin, now_ms(), divisor);
  return {};
}

Result<void> Viewer::draw_if_due() {
  const double now = now_ms();
  if (size_.width == 0 || !(pace_.due(now) || refinable(now))) return {};
  return draw(pace_.moving(now) && !plan_.finest ? guard_.divisor() : 1);
}

void Viewer::note_drawn(double begin, double end, std::uint32_t divisor) {
  pace_.drawn(begin, end);
  if (pace_.moving(begin) && stage_.whole()) guard_.drawn(divisor, end - begin);
  drawn_divisor_ = divisor;
  drew_ = true;
  if (!stage_.ready()) return;
  if (answers_us_ > 0) note_lag(end - static_cast<double>(std::exchange(answers_us_, 0)) / 1000);
  if (frame_ > 0) stream_->shown(std::exchange(frame_, 0), static_cast<std::int64_t>((end - begin) * 1000));
  frames_.add(end);
  if (whole_ms_ > 0) {
    ++figures_.frames_drawn;
    if (!stream_->connected()) ++figures_.frames_drawn_alone;
    figures_.draw_ms.add(end - begin);
    figures_.coarsest = std::max(figures_.coarsest, divisor);
  } else if (stage_.whole()) {
    whole_ms_ = end;
    stream_->pictured();
    figures_.first_picture_seconds = (end - start_ms_) / 1000;
    figures_.first_picture_bytes = stream_->traffic().received;
    figures_.upload_ms = Series();  // those of geometry are no frame's
  }
  measured_.draw_ms = end - begin;
  measured_.divisor = divisor;
}

Result<void> Viewer::refresh_panel() {
  const double now = now_ms();
  panel_ms_ = now;
  measured_.traffic = stream_->traffic();
  stream_bytes_.add(
      now, static_cast<double>(measured_.traffic.stream - std::exchange(counted_bytes_, measured_.traffic.stream)));
  measured_.bits_per_second = stream_bytes_.per_second(now) * 8;
  measured_.frames_per_second.reset();
  if (pace_.moving(now)) measured_.frames_per_second = frames_.per_second(now);
  measured_.decode_ms = figures_.decode_ms.empty() ? 0 : figures_.decode_ms.last();
  measured_.upload_ms = figures_.upload_ms.empty() ? 0 : figures_.upload_ms.last();
  measured_.seconds = (now - start_ms_) / 1000;
  if (stage_.ready() && size_.width > 0) {
    const auto counts = stage_.renderer().count_residency(*stage_.scene(), view(), kCountCoarseness);
    if (!counts) return std::unexpected(counts.error());
    measured_.residency = *counts;
  }
  show_.lines = panel_lines(measured_);
  show_.brief = brief_lines(measured_);
  return {};
}

Result<void> Viewer::present() {
  if (saving_.valid() && saving_.wait_for(std::chrono::seconds(0)) == std::future_status::ready)
    stream_->say(saving_.get(), now_ms(), 4);
  const double now = now_ms();
  const bool panel_due = show_.panel && !show_.bare && now - panel_ms_ >= kPanelEveryMs;
  Notice notice = stream_->words(now);
  const bool new_words = notice.quiet != show_.notice.quiet || notice.alert != show_.notice.alert;
  if (!controls_->take_events() && !drew_ && !panel_due && !new_words) return {};
  if (size_.width == 0) return {};
  if (panel_due) {
    if (auto ok = refresh_panel(); !ok) return ok;
  }
  drew_ = false;
  show_.notice = std::move(notice);
  show_.mode = rig_.mode;
  stage_.present(size_);
  for (const Action action : overlay_->draw(show_)) obey(action);
  window_->swap();
  return {};
}

void Viewer::obey(Action action) {
  switch (action) {
    case Action::kPanel:
      show_.panel = !show_.panel;
      panel_ms_ = 0;
      break;
    case Action::kMode:
      controls_->toggle_mode();
      break;
    case Action::kStart:
      go_to_start();
      break;
    case Action::kBare:
      show_.bare = !show_.bare;
      break;
    case Action::kHelp:
      show_.help = !show_.help;
      break;
    case Action::kCloseHelp:
      show_.help = false;
      break;
    case Action::kLink:
      window_->set_clipboard(to_link(rig_.view));
      stream_->say("The end of a link to this view is copied: it follows the server's web address, or --camera.",
                   now_ms(), 4);
      break;
    case Action::kScreenshot:
      save_picture();
      break;
    case Action::kFullScreen:
      window_->toggle_full_screen();
      break;
    case Action::kQuit:
      window_->close();
      break;
  }
  drew_ = true;
}

// Compressing takes longer than a frame may.
void Viewer::save_picture() {
  if (saving_.valid() || !stage_.ready()) return;
  if (drawn_divisor_ > 1) {
    if (auto ok = draw(1); !ok) return stream_->say(ok.error().message, now_ms(), 4);
  }
  auto picture = stage_.renderer().read_picture();
  if (!picture) return stream_->say(picture.error().message, now_ms(), 4);
  saving_ = std::async(std::launch::async, [image = std::move(*picture)] {
    const std::string name = picture_name();
    const auto written = write_png(name, image);
    return written ? "Saved as " + name + "." : written.error().message;
  });
}

Result<void> Viewer::leave() {
  if (saving_.valid()) saving_.wait();
  if (time_over() && !plan_.screenshot.empty()) {
    if (auto ok = draw(1); !ok) return ok;
    if (!stage_.whole()) return nothing_seen();
    const auto picture = stage_.renderer().read_picture();
    if (!picture) return std::unexpected(picture.error());
    if (auto ok = write_png(plan_.screenshot, *picture); !ok) return ok;
  }
  if (auto ok = report(); !ok) return ok;
  return time_over() && whole_ms_ <= 0 ? nothing_seen() : Result<void>();
}

Result<void> Viewer::nothing_seen() const {
  const Notice notice = stream_->words(now_ms());
  return fail(
      fmt::format("no whole picture in {} s: {}", *plan_.seconds, notice.alert.empty() ? notice.quiet : notice.alert));
}

Result<void> Viewer::report() {
  if (plan_.report.empty()) return {};
  if (auto ok = refresh_panel(); !ok) return ok;
  figures_.seconds = whole_ms_ > 0 ? (now_ms() - whole_ms_) / 1000 : 0;
  figures_.joins = stream_->joins();
  figures_.width = size_.width;
  figures_.height = size_.height;
  if (stage_.ready()) figures_.device = stage_.renderer().device();
  const std::string text = report_json(figures_, measured_) + "\n";
  if (plan_.report == "-") {
    std::cout << text << std::flush;
    return {};
  }
  std::ofstream out(plan_.report);
  out << text;
  out.close();
  return out ? Result<void>() : fail(plan_.report.string() + ": cannot be written");
}

}  // namespace

Result<void> visit(const VisitPlan& plan) {
  auto window = Window::open(plan.window);
  if (!window) return std::unexpected(window.error());
  return Viewer(plan, std::move(*window)).run();
}

}  // namespace darm::client::desktop
