#include "daemon/accuracy/camera_study.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "daemon/accuracy/replay.hpp"
#include "daemon/reference_file.hpp"
#include "daemon/reference_words.hpp"

namespace darm::accuracy {
namespace {

constexpr std::uint32_t kMostReferenceSamples = 1u << 16;
constexpr int kMostTries = 5;
constexpr const char* kSuspended = "the process was suspended in each try; the same command measures it later";
constexpr std::uint32_t kHalvesSamples = 8;  // the noise of so few cancels over a picture's pixels

std::string of_seconds(const std::string& words, double now, double all) {
  char out[64];
  std::snprintf(out, sizeof out, ", %.0f of %.0f s", now, all);
  return words + out;
}

// The scene without its lights or sky. Everything else is shared with nobody: a copy, while it is needed.
std::shared_ptr<const scene::Scene> without_lights(const scene::Scene& scene, const LeftOut& left_out) {
  auto copy = std::make_shared<scene::Scene>(scene);
  if (left_out.sun_and_lamps) copy->lights.clear();
  if (left_out.sky) copy->sky = {};
  return copy;
}

}  // namespace

CameraStudy::CameraStudy(const World& world, CameraStudyOptions options)
    : world_(world),
      options_(std::move(options)),
      view_(*world.layout, *world.rays, options_.camera, options_.viewport, options_.threads) {}

renderer::ReferenceJob CameraStudy::job() const {
  renderer::ReferenceJob job;
  job.camera = options_.camera;
  job.viewport = options_.viewport;
  job.exposure = world_.exposure;
  job.effects = renderer::PictureEffects::kViewIndependent;
  job.threads = options_.threads;
  return job;
}

Result<bool> CameraStudy::prepare() {
  auto reference = job();
  reference.seed_a = 2;  // as darmd render without --seed: the same file serves both
  reference.seed_b = 3;
  reference.spp = kMostReferenceSamples;
  reference.until_psnr = options_.reference_psnr;
  reference.state_file = reference_file(options_.state_dir, *world_.transport, reference);
  reference.warn = options_.warn;
  reference.progress = [this](const renderer::ReferenceProgress& p) {
    options_.progress(0, options_.name + ": reference to " + decibel_words(options_.reference_psnr) + ", " +
                             reference_words(p, kMostReferenceSamples));
    return !options_.stopped();
  };
  auto made = renderer::render_reference(*world_.transport, reference);
  if (!made) return std::unexpected(made.error());
  if (made->stopped) return false;
  own_psnr_ = std::min(made->own_psnr, kMostDecibels);
  reference_ = std::make_unique<const ShownHalves>(Halves{std::move(made->half_a), std::move(made->half_b)});
  return true;
}

CameraFacts CameraStudy::facts() const { return {options_.name, counted_share(view_.counted()), own_psnr_}; }

Measurement CameraStudy::begin(const Variant& variant) const {
  Measurement m;
  m.camera = options_.name;
  m.group = variant.group;
  m.variant = variant.name;
  return m;
}

Result<CameraStudy::Outcome> CameraStudy::measure(const Variant& variant) {
  switch (variant.method) {
    case Method::kFrames:
      return measure_frames(variant);
    case Method::kCodec:
      return measure_codec(variant);
    case Method::kWithout:
      return measure_without(variant);
    default:
      return measure_atlas(variant);
  }
}

Result<Recording> CameraStudy::record_once(const World& world, const Variant& variant) const {
  RunOptions run;
  run.config = variant.config;
  run.camera = options_.camera;
  run.viewport = options_.viewport;
  run.seconds = variant.seconds;
  run.private_layer = variant.private_layer;
  run.folder = options_.out / ".darmd-accuracy-run";
  run.stopped = options_.stopped;
  run.progress = [this, &variant](double now) {
    options_.progress(now, of_seconds(options_.name + ": " + variant.name, now, variant.seconds));
  };
  return record_run(world, run);
}

Result<Recording> CameraStudy::record(const World& world, const Variant& variant) const {
  for (int tries = 1;; ++tries) {
    auto made = record_once(world, variant);
    if (!made || made->stopped || !made->disturbed) return made;
    if (tries == kMostTries) return made;
    options_.warn(options_.name + ": " + variant.name +
                  ": the process was suspended meanwhile; the run is begun again");
  }
}

Result<CameraStudy::Outcome> CameraStudy::measure_atlas(const Variant& variant) {
  const bool other_density = variant.group == Group::kDensity;
  std::optional<World> dense;
  std::optional<SoftwareView> dense_view;
  if (other_density) {
    auto loaded = load_world(variant.config, options_.threads);
    if (!loaded) return Outcome{std::nullopt, loaded.error().message};
    dense = std::move(*loaded);
    dense_view.emplace(*dense->layout, *dense->rays, options_.camera, options_.viewport, options_.threads);
  }
  const World& world = dense ? *dense : world_;
  const SoftwareView& view = dense_view ? *dense_view : view_;
  auto recording = record(world, variant);
  if (!recording) return std::unexpected(recording.error());
  if (recording->stopped) return Outcome{};
  if (recording->disturbed) return Outcome{std::nullopt, kSuspended};
  options_.progress(variant.seconds, options_.name + ": " + variant.name + ", drawing");
  const auto replayed = replay(*recording, *world.layout, view, *reference_,
                               {.phystex_size = variant.config.stream.phystex, .threads = options_.threads});
  if (!replayed) return std::unexpected(replayed.error());
  if (replayed->curve.empty()) return Outcome{std::nullopt, "no full picture came in its time; give it more --seconds"};
  auto m = begin(variant);
  m.curve = replayed->curve;
  m.figures[figure::kLightDb] = replayed->light_db;
  m.figures[figure::kBytes] = replayed->bytes;
  if (recording->finished) m.figures[figure::kStoppedEarly] = recording->frames.back().seconds;
  if (variant.group == Group::kPresets && variant.name == kBalanced) balanced_ = std::move(*recording);
  return Outcome{std::move(m), {}};
}

Result<CameraStudy::Outcome> CameraStudy::measure_frames(const Variant& variant) {
  auto frames = job();
  frames.seed_a = 101;  // neither the reference's nor an effect's
  frames.seed_b = 102;
  auto traced = trace_frames(
      *world_.transport, frames, *reference_, view_.counted(), variant.seconds, options_.out / "frames.bin",
      [this] { return !options_.stopped(); },
      [this, &variant](double now) {
        options_.progress(now, of_seconds(options_.name + ": " + variant.name, now, variant.seconds));
      });
  if (!traced) return std::unexpected(traced.error());
  if (traced->stopped) return Outcome{};
  auto m = begin(variant);
  m.curve = std::move(traced->curve);
  return Outcome{std::move(m), {}};
}

Result<CameraStudy::Outcome> CameraStudy::measure_codec(const Variant& variant) {
  if (!balanced_) {  // measured in an earlier run: its light is made again
    auto recording = record(world_, variant);
    if (!recording) return std::unexpected(recording.error());
    if (recording->stopped) return Outcome{};
    if (recording->disturbed) return Outcome{std::nullopt, kSuspended};
    balanced_ = std::move(*recording);
  }
  options_.progress(variant.seconds, options_.name + ": " + variant.name);
  const auto recoded =
      recode(*balanced_, *world_.layout, view_, *reference_, variant.config.stream, variant.crf, options_.threads);
  if (!recoded) return std::unexpected(recoded.error());
  auto m = begin(variant);
  m.curve = recoded->curve;
  m.figures[figure::kBytes] = recoded->bytes;
  if (recoded->first) {
    m.figures[figure::kFirstBytes] = recoded->first->bytes;
    m.figures[figure::kFirstCodecDb] = recoded->first->codec_db;
  }
  m.figures[figure::kLastCodecDb] = recoded->last_codec_db;
  m.figures[figure::kEncodeSeconds] = recoded->encode_seconds;
  return Outcome{std::move(m), {}};
}

Result<const TracedHalves*> CameraStudy::traced_with(renderer::PictureEffects effects) {
  auto& kept = effects == renderer::PictureEffects::kFull ? with_full_ : with_shared_;
  if (!kept) {
    auto with = job();
    with.effects = effects;
    with.seed_a = 201;
    with.seed_b = 202;
    auto traced = trace_halves(*world_.transport, with, kHalvesSamples, [this] { return !options_.stopped(); });
    if (!traced) return std::unexpected(traced.error());
    if (traced->stopped) return nullptr;
    kept = std::move(*traced);
  }
  return &*kept;
}

Result<CameraStudy::Outcome> CameraStudy::measure_without(const Variant& variant) {
  options_.progress(0, options_.name + ": without " + variant.name);
  const auto& left_out = variant.left_out;
  const auto effects =
      left_out.private_layer ? renderer::PictureEffects::kFull : renderer::PictureEffects::kViewIndependent;
  const auto with = traced_with(effects);
  if (!with) return std::unexpected(with.error());
  if (*with == nullptr) return Outcome{};
  auto scene = world_.scene;
  auto rays = world_.rays;
  if (left_out.sun_and_lamps || left_out.sky) {
    scene = without_lights(*world_.scene, left_out);
    auto built = renderer::trace::RayScene::build(scene, options_.threads);
    if (!built) return std::unexpected(built.error());
    rays = std::move(*built);
  }
  renderer::TransportOptions transport;
  if (left_out.max_bounces) transport.max_bounces = *left_out.max_bounces;
  auto less = job();
  less.seed_a = 301;
  less.seed_b = 302;
  const auto without = trace_halves(renderer::LightTransport(scene, rays, transport), less, kHalvesSamples,
                                    [this] { return !options_.stopped(); });
  if (!without) return std::unexpected(without.error());
  if (without->stopped) return Outcome{};
  // What depends on the eye is much of what is seen through: there every pixel counts.
  const PixelMask all(view_.counted().size(), 1);
  const auto apart = difference((*with)->halves, without->halves, left_out.private_layer ? all : view_.counted());
  const bool seen = apart.mse > 2 * apart.standard_error;
  auto m = begin(variant);
  m.figures[figure::kWithoutDb] = psnr(seen ? apart.mse : std::max(apart.mse, 0.0) + 2 * apart.standard_error);
  m.figures[figure::kAtLeast] = seen ? 0 : 1;
  m.figures[figure::kSecondsWith] = (*with)->seconds_per_sample;
  m.figures[figure::kSecondsWithout] = without->seconds_per_sample;
  return Outcome{std::move(m), {}};
}

}  // namespace darm::accuracy
