#include "daemon/accuracy/study.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "actors/scene/effect_plan.hpp"
#include "daemon/accuracy/camera_study.hpp"
#include "daemon/accuracy/machine_speed.hpp"
#include "daemon/accuracy/report/results_file.hpp"
#include "daemon/accuracy/report/text.hpp"
#include "daemon/accuracy/result_key.hpp"
#include "daemon/accuracy/variants.hpp"
#include "daemon/scene_setup.hpp"
#include "daemon/world.hpp"
#include "daemon/writable.hpp"

namespace darm::accuracy {
namespace {

namespace fs = std::filesystem;

/// Seconds that drawing and comparing come to, for the bar.
constexpr double kOverhead = 5;

/// Of looking at the machine's speed, before and after each variant.
constexpr double kSpeedSeconds = 0.1;

using Kept = std::map<std::string, Measurement>;  // by key

struct NamedView {
  std::string name;
  Camera camera;
};

Result<std::vector<NamedView>> views_of(const StudyOptions& options, const scene::Scene& scene) {
  std::vector<NamedView> views;
  for (const auto& spec : options.cameras) {
    const auto camera = find_camera(options.config, scene, spec);
    if (!camera) return std::unexpected(camera.error());
    const bool twice = std::any_of(views.begin(), views.end(), [&](const NamedView& v) { return v.name == spec; });
    if (!twice) views.push_back({spec, *camera});
  }
  if (views.empty())
    views.push_back({options.config.cameras.empty() ? "start" : options.config.cameras.front().name,
                     start_camera(options.config, scene)});
  return views;
}

std::string blind_words(const std::string& camera) {
  return "camera " + camera + " sees no opaque surface, only sky or what is seen through";
}

double worth_of(const Variant& v) {
  return (v.method == Method::kAtlas || v.method == Method::kFrames ? v.seconds : 0) + kOverhead;
}

std::string words_of(const Measurement& m) {
  std::string out = m.camera + ": " + m.variant;
  if (!m.curve.empty())
    out += ", " + db_text(m.curve.back().db) + " dB after " + seconds_text(m.curve.back().seconds) + " s";
  if (const auto it = m.figures.find(figure::kWithoutDb); it != m.figures.end()) {
    const auto bound = m.figures.find(figure::kAtLeast);
    out += std::string(" left out, ") + (bound != m.figures.end() && bound->second > 0 ? "over " : "");
    out += db_text(it->second) + " dB";
  }
  return out;
}

class Runner {
 public:
  Runner(const StudyOptions& options, Progress& progress, const World& world)
      : options_(options), progress_(progress), world_(world), threads_(thread_count(options.config)) {}

  Result<Study> run();

 private:
  [[nodiscard]] fs::path results_file() const { return options_.out / "results.jsonl"; }
  [[nodiscard]] std::string key_of(const NamedView& view, const Variant& variant) const;
  [[nodiscard]] CameraStudyOptions camera_options(const NamedView& view) const;
  [[nodiscard]] double speed_now(const NamedView& view) const {
    return rays_per_second(*world_.rays, view.camera, threads_, kSpeedSeconds);
  }
  [[nodiscard]] Result<void> measure_view(const NamedView& view, const std::vector<Variant>& variants);
  void describe();
  void collect(const std::vector<NamedView>& views, const std::vector<Variant>& all);

  const StudyOptions& options_;
  Progress& progress_;
  const World& world_;
  unsigned threads_;
  double began_ =
      std::floor(std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count());
  Kept kept_;
  std::vector<std::string> blind_;  // cameras that see nothing
  bool alone_ = false;              // there is one camera
  std::string why_left_out_;        // the last one
  Study study_;
};

std::string Runner::key_of(const NamedView& view, const Variant& variant) const {
  return result_key(
      {world_.scene->hash, world_.exposure, view.camera, options_.viewport, threads_, options_.reference_psnr},
      variant);
}

CameraStudyOptions Runner::camera_options(const NamedView& view) const {
  CameraStudyOptions out;
  out.name = view.name;
  out.camera = view.camera;
  out.viewport = options_.viewport;
  out.threads = threads_;
  out.reference_psnr = options_.reference_psnr;
  out.state_dir = options_.config.state.dir;
  out.out = options_.out;
  out.stopped = [this] { return options_.stopped && options_.stopped(); };
  out.progress = [this](double seconds, const std::string& words) { progress_.show(seconds, words); };
  out.warn = [this](const std::string& words) { progress_.warn(words); };
  return out;
}

// The reference is made, or read, even where nothing is left to measure: the report names its accuracy.
Result<void> Runner::measure_view(const NamedView& view, const std::vector<Variant>& variants) {
  CameraStudy camera(world_, camera_options(view));
  if (!camera.sees_anything()) {
    blind_.push_back(view.name);
    if (!alone_) progress_.warn(blind_words(view.name) + "; it is left out");
    return {};
  }
  const auto prepared = camera.prepare();
  if (!prepared) return std::unexpected(prepared.error());
  study_.stopped = study_.stopped || !*prepared;
  if (study_.stopped) return {};
  study_.report.cameras.push_back(camera.facts());
  for (const auto& variant : variants) {
    const auto key = key_of(view, variant);
    if (kept_.contains(key)) {
      ++study_.kept;
      progress_.done(worth_of(variant), words_of(kept_[key]) + " (measured before)");
      continue;
    }
    study_.stopped = options_.stopped && options_.stopped();  // not every variant asks
    if (study_.stopped) return {};
    const double before = speed_now(view);
    auto outcome = camera.measure(variant);
    if (!outcome) return std::unexpected(outcome.error().within(view.name + ": " + variant.name));
    if (!outcome->impossible.empty()) {
      progress_.warn(view.name + ": " + variant.name + " is left out: " + outcome->impossible);
      ++study_.left_out;
      why_left_out_ = outcome->impossible;
      continue;
    }
    if (!outcome->measurement) {
      study_.stopped = true;
      return {};
    }
    auto& m = *outcome->measurement;
    m.key = key;
    m.figures[figure::kRunBegan] = began_;
    m.figures[figure::kRaysPerSecond] = (before + speed_now(view)) / 2;
    if (auto saved = append_result(results_file(), m); !saved) return saved;
    ++study_.measured;
    progress_.done(worth_of(variant), words_of(m));
    kept_[key] = std::move(m);
  }
  return {};
}

void Runner::describe() {
  auto& report = study_.report;
  report.scene = fs::path(world_.scene->path).filename().string();
  report.triangles = world_.scene->triangle_count();
  report.q = static_cast<double>(world_.layout->q);
  report.threads = threads_;
  report.width = options_.viewport.width;
  report.height = options_.viewport.height;
  report.seconds = options_.seconds;
  for (const auto& effect : scene::plan_effects(*world_.scene).effects)
    report.plan.push_back({effect.name, effect.needed, effect.reason, {}});
}

void Runner::collect(const std::vector<NamedView>& views, const std::vector<Variant>& all) {
  for (const auto& view : views) {
    if (std::ranges::find(blind_, view.name) != blind_.end()) continue;  // results from before it was looked at
    for (const auto& variant : all)
      if (const auto it = kept_.find(key_of(view, variant)); it != kept_.end()) {
        study_.report.measurements.push_back(it->second);
        study_.report.measurements.back().camera = view.name;  // the same view may have had another name
      }
  }
}

Result<Study> Runner::run() {
  const auto views = views_of(options_, *world_.scene);
  if (!views) return std::unexpected(views.error());
  alone_ = views->size() == 1;
  auto earlier = load_results(results_file());
  if (!earlier) return std::unexpected(earlier.error());
  for (auto& m : *earlier) kept_[m.key] = std::move(m);
  describe();
  const auto all = variants_of(
      {options_.config, static_cast<double>(world_.layout->q), options_.seconds, scene::plan_effects(*world_.scene)});
  const auto variants = chosen(all, options_.only);
  if (!variants) return std::unexpected(variants.error());
  double total = 0;
  for (const auto& v : *variants) total += worth_of(v) * static_cast<double>(views->size());
  progress_.begin(total);
  for (const auto& view : *views) {
    if (auto done = measure_view(view, *variants); !done) return std::unexpected(done.error());
    if (study_.stopped) break;
  }
  if (blind_.size() == views->size())
    return fail((alone_ ? "" : "no camera is left: ") + blind_words(blind_.front()) + "; name another with --cameras");
  if (study_.left_out > 0 && study_.measured + study_.kept == 0 && !study_.stopped)
    return fail("nothing was measured: " + why_left_out_);
  collect(*views, all);
  return std::move(study_);
}

}  // namespace

Result<Study> run_study(const StudyOptions& options, Progress& progress) {
  if (auto ok = make_writable_folder(options.config.state.dir); !ok) return std::unexpected(ok.error());
  if (auto ok = make_writable_folder(options.out); !ok) return std::unexpected(ok.error());
  if (auto ok = check_writable_file(options.out / "results.jsonl"); !ok) return std::unexpected(ok.error());
  progress.show(0, "loading the scene");
  const auto world = load_world(options.config, thread_count(options.config));
  if (!world) return std::unexpected(world.error());
  return Runner(options, progress, *world).run();
}

}  // namespace darm::accuracy
