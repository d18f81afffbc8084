#include "actors/renderer/renderer_actor.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <exception>
#include <limits>
#include <utility>

#include "actors/renderer/bright_samples.hpp"
#include "actors/renderer/display_curve.hpp"
#include "actors/renderer/divided_texels.hpp"
#include "actors/renderer/stored_light.hpp"
#include "actors/renderer/texel_shading.hpp"

namespace darm::renderer {

namespace {

constexpr std::size_t kPicturesPerSlice = 8;
constexpr std::uint32_t kLastRenewed = 4;     // round of the coarse level
constexpr float kRareLight = 0.2f;            // of what the coarse level shows
constexpr double kPressingShare = 0.5;        // of shading
constexpr std::uint32_t kFirstOfBright = 16;  // samples of a texel that emitters shine on
// Of the flux of bright texels: all others hear of its error, and hear it again at each bounce.
constexpr float kFirstTolerance = 0.02f;  // for the first picture
constexpr float kTolerance = 0.005f;

/// Bumped whenever the same light would be drawn in another way: stored pictures are then not used.
constexpr std::uint64_t kDisplayVersion = 8;

// What a stored picture depends on beside its light.
std::uint64_t picture_tag_of(const DisplayOptions& display) {
  const std::uint64_t options = std::uint64_t{std::bit_cast<std::uint32_t>(display.exposure)} << 32 |
                                std::bit_cast<std::uint32_t>(display.filter_samples);
  return (options * 0x9e3779b97f4a7c15ull ^ kDisplayVersion) | 1;
}

atlas::StoredPicture to_stored(const TilePicture& picture) {
  atlas::StoredPicture out;
  out.rgb = picture.image->rgb;
  if (picture.image->coverage) out.coverage = *picture.image->coverage;
  out.covered = picture.image->coverage ? 1 : 0;
  out.error = picture.error;
  out.samples = picture.samples;
  return out;
}

TilePicture from_stored(const atlas::StoredPicture& stored) {
  auto image = std::make_shared<TileImage>();
  image->rgb = stored.rgb;
  convert_to_planes(*image);
  if (stored.covered != 0) image->coverage = std::make_shared<const CoverageTile>(stored.coverage);
  return {std::move(image), stored.error, stored.samples};
}

}  // namespace

struct RendererActor::Shared {
  explicit Shared(RendererParts p)
      : parts(std::move(p)),
        divided(static_cast<int>(parts.levels.size()) - 1,
                parts.levels.empty() ? 0 : parts.levels.back().x * parts.levels.back().y) {}
  RendererParts parts;
  TileFactsCache facts;
  DividedTexels divided;                     // of the coarse level
  std::shared_ptr<const StoredLight> light;  // of the coarse level; changes between phases
  std::uint64_t picture_tag = picture_tag_of(parts.options.display);

  [[nodiscard]] runtime::MetricSink& metrics() const {
    return parts.metrics != nullptr ? *parts.metrics : runtime::null_metrics();
  }
  [[nodiscard]] LevelTiles level_of(TileId tile) const {
    const auto level = static_cast<std::size_t>(tile.level());
    return level < parts.levels.size() ? parts.levels[level] : LevelTiles{};
  }
};

struct RendererActor::JobResult {
  ShadingResult shading;
  std::optional<TilePicture> picture;
  std::optional<float> lost_share;  // of a tile of the coarse level that has light, as TilePicture has it
  double seconds = 0;
  bool failed = false;
};

struct RendererActor::Batch {
  std::vector<TileJob> jobs;
  std::vector<JobResult> results;  // each written by the one slice that runs the job
  std::shared_ptr<CoarseCanvas> canvas;
  std::shared_ptr<StoredLight> light;  // of the same tiles
  bool first = false;                  // light, before the coarse level has a picture
  bool of_all = false;                 // of what shines, all is known: not only what is seen
  std::vector<CoarseRequest> wanting;  // its bright texels, where those have too few samples
  std::uint32_t wanted = 0;            // so many would do
};

RendererActor::RendererActor(runtime::Context<Inbox> context, RendererParts parts)
    : Actor(std::move(context)),
      shared_(std::make_shared<Shared>(std::move(parts))),
      schedule_(shared_->parts.levels, shared_->parts.options.schedule),
      coarse_(static_cast<int>(shared_->parts.levels.size()) - 1,
              shared_->parts.levels.empty() ? LevelTiles{} : shared_->parts.levels.back(),
              shared_->parts.levels.empty() ? 0 : shared_->parts.options.coarse_rounds) {}

void RendererActor::on_start() {
  resume_coarse();
  if (coarse_.opening() && shared_->parts.layout) coarse_.hurry(shared_->parts.surfaces->shone_on(), kFirstOfBright);
  begin_batch();
}

// After a restart the coarse level is as far as its least lit tile was, and its stored pictures are shown at once.
void RendererActor::resume_coarse() {
  const auto& tiles = coarse_.tiles();
  if (coarse_.finished() || tiles.x == 0) return;
  float least = std::numeric_limits<float>::infinity();
  bool any = false;
  for (std::uint32_t t = 0; t < tiles.x * tiles.y; ++t) {
    const auto stored = shared_->parts.store->picture(TileId(coarse_.level(), t), shared_->picture_tag);
    any = any || stored;
    least = std::min(least, stored ? stored->samples : 0.0f);
  }
  if (!any) return;
  coarse_.resume(static_cast<std::uint32_t>(least));
  if (!shared_->parts.coarse) return;
  auto batch = std::make_shared<Batch>();
  add_coarse_level(*batch, CoarseDue::kPicture, true);
  draw(batch);
}

void RendererActor::on(ShadeTiles&& message) {
  waiting_ = std::move(message);
  if (phase_ == Phase::kIdle) begin_batch();
}

void RendererActor::on(SliceFinished&& message) {
  if (message.slice != batch_number_ || slices_left_ == 0) return;
  if (--slices_left_ > 0) return;
  const double seconds = static_cast<double>(now_us() - phase_began_us_) * 1e-6;
  if (phase_ == Phase::kShading) {
    shared_->metrics().observe("darm_renderer_phase_seconds", seconds, {{"phase", "shading"}});
    finish_shading();
  } else if (phase_ == Phase::kStoredLight) {
    finish_stored_light();
  } else {
    shared_->metrics().observe("darm_renderer_phase_seconds", seconds, {{"phase", "pictures"}});
    finish_pictures();
  }
}

// Much of the scene's light is in rare samples.
bool RendererActor::rare_light() const { return coarse_lost_share_ > kRareLight; }

// There samples of the coarse level, which paths end in, are worth most.
double RendererActor::coarse_share() const {
  if (coarse_.finished() && !coarse_.hurries()) return 0;
  const bool pressing = coarse_.hurries() || unsettled_until_ || (rare_light() && !coarse_.even());
  return pressing ? kPressingShare : double{shared_->parts.options.coarse_share};
}

std::vector<TileJob> RendererActor::choose_jobs() {
  const auto& options = shared_->parts.options;
  const double budget = std::max(64.0, double{options.batch_ms} * 1000.0 * executor().workers() / sample_us_);
  if (coarse_.opening()) return coarse_.next_batch(static_cast<std::uint64_t>(budget));
  const double share = coarse_share();
  auto jobs = schedule_.next_batch(static_cast<std::uint64_t>(budget * (1.0 - share)));
  // The coarse level earns its share of what visible tiles cost; with nothing visible it has all.
  std::uint64_t cost = 0;
  for (const auto& job : jobs) cost += job.cost;
  coarse_credit_ =
      jobs.empty() ? budget : coarse_credit_ + static_cast<double>(cost) * share / std::max(1.0 - share, 0.1);
  if (coarse_credit_ < kTileTexels / 2.0) return jobs;
  // A tile has one writer: while the coarse level's tiles are in the working set, its turn on them is skipped.
  const auto visible = static_cast<std::ptrdiff_t>(jobs.size());
  for (auto& job : coarse_.next_batch(static_cast<std::uint64_t>(coarse_credit_))) {
    coarse_credit_ -= job.cost;
    if (std::none_of(jobs.begin(), jobs.begin() + visible, [&](const TileJob& j) { return j.tile == job.tile; }))
      jobs.push_back(job);
  }
  return jobs;
}

// What was shown before, here or before a restart, is shown again before anything is computed.
bool RendererActor::begin_recall() {
  auto batch = std::make_shared<Batch>();
  for (const TileId tile : schedule_.recalls_due()) {
    TileJob job;
    job.tile = tile;
    job.recall = true;
    batch->jobs.push_back(job);
  }
  if (batch->jobs.empty()) return false;
  draw(batch);
  return true;
}

// The first samples of a scene whose light is rare say less than one that is aimed, and would be seen for long beside
// those that follow.
void RendererActor::learn_aim(bool aims) {
  if (unsettled_until_ && coarse_.round() > *unsettled_until_) unsettled_until_.reset();
  if (aims_ || !aims) return;
  aims_ = true;
  if (coarse_.opening() || coarse_.finished() || coarse_.round() > kLastRenewed) return;  // nothing was lit, or enough
  renews_ = true;
  unsettled_until_ = coarse_.round();
}

void RendererActor::renew(std::vector<TileJob>& jobs) {
  if (!renews_) return;
  for (TileJob& job : jobs) {
    if (job.passes == 0 || job.hurried || !renewed_.insert(job.tile).second) continue;
    job.renew = true;
    schedule_.forget_picture(job.tile);
  }
}

void RendererActor::begin_batch() {
  if (phase_ == Phase::kPictures && slices_left_ > 0) return;
  if (waiting_) {
    static const std::vector<TileRequest> kNothing;
    schedule_.replace(waiting_->work ? *waiting_->work : kNothing,
                      [this](TileId tile) { return shared_->parts.store->has(tile); });
    coarse_.prefer(waiting_->coarse);
    waiting_.reset();
    if (begin_recall()) return;
  }
  auto batch = std::make_shared<Batch>();
  batch->jobs = choose_jobs();
  renew(batch->jobs);
  if (batch->jobs.empty()) {
    batch_ = std::move(batch);
    begin_pictures();  // a tile back in view has its picture due, with nothing left to shade
    return;
  }
  phase_ = Phase::kShading;
  const double slice_samples = double{shared_->parts.options.slice_ms} * 1000.0 / sample_us_;
  std::vector<std::size_t> starts;
  double filled = slice_samples;
  for (std::size_t i = 0; i < batch->jobs.size(); ++i) {
    if (filled >= slice_samples) {
      starts.push_back(i);
      filled = 0;
    }
    filled += batch->jobs[i].cost;
  }
  post_slices(batch, std::move(starts), &RendererActor::shade_one);
}

void RendererActor::post_slices(const std::shared_ptr<Batch>& batch, std::vector<std::size_t> starts,
                                void (*work)(Shared&, Batch&, std::size_t)) {
  batch_ = batch;
  batch_->results.resize(batch_->jobs.size());
  ++batch_number_;
  slices_left_ = starts.size();
  phase_began_us_ = now_us();
  for (std::size_t s = 0; s < starts.size(); ++s) {
    const std::size_t first = starts[s];
    const std::size_t end = s + 1 < starts.size() ? starts[s + 1] : batch_->jobs.size();
    executor().post(
        runtime::Priority::kNormal, [shared = shared_, batch, first, end, work, me = self(), number = batch_number_] {
          for (std::size_t i = first; i < end; ++i) {
            const auto began = std::chrono::steady_clock::now();
            try {
              work(*shared, *batch, i);
            } catch (const std::exception&) {
              batch->results[i].failed = true;  // retried once, then the tile is quarantined
            }
            batch->results[i].seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
          }
          me.tell(SliceFinished(number));
        });
  }
}

void RendererActor::shade_one(Shared& shared, Batch& batch, std::size_t index) {
  const TileJob& job = batch.jobs[index];
  JobResult& result = batch.results[index];
  const auto surface = shared.parts.surfaces->tile(job.tile);
  if (!surface) return;  // outside the atlas: nothing to shade, nothing to show
  if (job.passes == 0) {
    result.shading.progress = survey_tile(*shared.parts.store, job.tile, job.mask, *surface);
  } else {
    auto shaded = shade_tile(*shared.parts.store, job.tile, job.mask, job.passes, *surface, job.most,
                             job.renew ? Few::kReplaced : Few::kKept);
    if (!shaded) {
      result.failed = true;
      return;
    }
    result.shading = *shaded;
  }
  const LevelTiles level = shared.level_of(job.tile);
  const auto facts = shared.facts.get(job.tile, *shared.parts.surfaces, *shared.parts.store);
  // Of the coarse level, too: its pictures are stored, and recalled for tiles that get a slot.
  if (facts) facts->learn_coverage(job.tile, level, *shared.parts.surfaces);
  const float least = result.shading.progress.least;
  if (!facts || result.shading.progress.mean <= 0) return;
  TexelMask wanted = job.mask;
  // Emission is not stored: what was lit before a restart has to be learned for all that is lit, not for this view.
  if (job.passes == 0 && surface->emits()) wanted |= lit_texels(*shared.parts.store, job.tile);
  if (!facts->learn_albedo(*surface, wanted, least < 1 ? 2 : least < 2 ? 4 : least < 16 ? 16 : 32)) return;
  if (auto update = shared.parts.store->begin_update(job.tile)) update->put_albedo(facts->albedo_means);
}

void RendererActor::learn_cost(double seconds, std::uint64_t samples) {
  if (samples < 64 || seconds <= 0) return;
  const double now = std::clamp(seconds * 1e6 / static_cast<double>(samples), 0.2, 2000.0);
  sample_us_ += 0.25 * (now - sample_us_);
}

void RendererActor::finish_shading() {
  double seconds = 0;
  std::uint64_t samples = 0;
  std::uint64_t bad = 0;
  std::uint64_t tiles = 0;
  std::uint64_t given_up = 0;
  for (std::size_t i = 0; i < batch_->jobs.size(); ++i) {
    const TileJob& job = batch_->jobs[i];
    const JobResult& r = batch_->results[i];
    if (r.failed) {
      if (!job.coarse && !schedule_.failed(job.tile)) ++given_up;
      continue;
    }
    if (!job.coarse) schedule_.shaded(job.tile, r.shading.progress, r.shading.samples);
    samples += r.shading.samples;
    bad += r.shading.quarantined;
    tiles += r.shading.samples > 0 ? 1 : 0;
    if (r.shading.samples > 0) seconds += r.seconds;
  }
  learn_cost(seconds, samples);
  coarse_due_ = std::max(coarse_.batch_finished(), coarse_due_);
  auto& metrics = shared_->metrics();
  metrics.count("darm_renderer_texel_samples_total", static_cast<double>(samples));
  metrics.count("darm_renderer_tiles_shaded_total", static_cast<double>(tiles));
  if (bad > 0) metrics.count("darm_renderer_quarantined_samples_total", static_cast<double>(bad));
  if (given_up > 0) metrics.count("darm_renderer_quarantined_tiles_total", static_cast<double>(given_up));
  const auto stored = shared_->parts.store->counters();
  metrics.set("darm_store_tiles", static_cast<double>(stored.tiles));
  metrics.set("darm_store_bytes", static_cast<double>(stored.bytes));
  metrics.set("darm_store_torn_tiles", static_cast<double>(stored.torn));
  metrics.set("darm_store_refused_updates", static_cast<double>(stored.refused_full));
  begin_pictures();
}

void RendererActor::begin_pictures() {
  auto next = std::make_shared<Batch>();
  for (const TileId tile : schedule_.pictures_due()) {
    TileJob job;
    job.tile = tile;
    job.mask = *schedule_.mask_of(tile);
    next->jobs.push_back(job);
  }
  if (shared_->parts.coarse) add_coarse_level(*next, coarse_due_, false);
  coarse_due_ = CoarseDue::kNothing;
  if (next->jobs.empty()) {
    const bool worked = !batch_->jobs.empty();
    phase_ = Phase::kIdle;
    if (worked || waiting_) begin_batch();
    return;
  }
  draw(next);
}

void RendererActor::add_coarse_level(Batch& batch, CoarseDue due, bool recall) {
  if (due == CoarseDue::kNothing) return;
  TileJob job;
  job.mask = TexelMask::all();
  job.coarse = true;
  job.recall = recall;
  const auto add = [&](std::uint32_t tile) {
    job.tile = TileId(coarse_.level(), tile);
    job.keep = due == CoarseDue::kPicture && !schedule_.has(job.tile);  // one writer
    batch.jobs.push_back(job);
  };
  batch.first = coarse_.opening();
  batch.of_all = due == CoarseDue::kLight || coarse_.round() > 0;
  if (due == CoarseDue::kLight) {  // all else is as it was
    batch.light = shared_->light ? std::make_shared<StoredLight>(*shared_->light)
                                 : std::make_shared<StoredLight>(shared_->parts.layout);
    for (const CoarseRequest& texels : coarse_.hurried()) add(texels.tile);
    return;
  }
  batch.canvas = std::make_shared<CoarseCanvas>(coarse_.tiles(), ++coarse_number_);
  if (shared_->parts.layout) batch.light = std::make_shared<StoredLight>(shared_->parts.layout);
  for (std::uint32_t t = 0; t < coarse_.tiles().x * coarse_.tiles().y; ++t) add(t);
}

void RendererActor::draw(const std::shared_ptr<Batch>& batch) {
  phase_ = Phase::kPictures;
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < batch->jobs.size(); i += kPicturesPerSlice) starts.push_back(i);
  post_slices(batch, std::move(starts), &RendererActor::picture_one);
}

void RendererActor::picture_one(Shared& shared, Batch& batch, std::size_t index) {
  const TileJob& job = batch.jobs[index];
  auto& store = *shared.parts.store;
  std::optional<TilePicture> picture;
  TileDisplay display(store, shared.facts, shared.parts.options.display, shared.light.get());
  if (job.recall) {
    if (const auto stored = store.picture(job.tile, shared.picture_tag)) picture = from_stored(*stored);
  } else {
    // CoarseTex is seen where it is lit: before its first round that is what views asked for.
    const TexelMask mask = job.coarse ? lit_texels(store, job.tile) : job.mask;
    picture = display.draw(job.tile, shared.level_of(job.tile), mask, job.coarse ? Unlit::kGrey : Unlit::kAsBeside);
    if (picture && job.keep) store.put_picture(job.tile, shared.picture_tag, to_stored(*picture));
  }
  if (job.coarse) {
    if (const auto light = store.read(job.tile); light && batch.light) {
      auto texels = stored_texels(*light, display.filtered());
      shared.divided.forget(job.tile.index(), texels, *shared.parts.surfaces);
      batch.light->put(job.tile.index(), texels);
    }
    if (picture && batch.canvas) batch.canvas->put(job.tile.index(), *picture->image, picture->error);
    if (picture && picture->samples > 0) batch.results[index].lost_share = picture->lost_share;
  } else {
    batch.results[index].picture = std::move(picture);
  }
}

float RendererActor::mean_lost_share(const Batch& batch) {
  float sum = 0, tiles = 0;
  for (const JobResult& r : batch.results)
    if (r.lost_share) sum += *r.lost_share, ++tiles;
  return tiles > 0 ? sum / tiles : 0.0f;
}

void RendererActor::finish_pictures() {
  send_pictures();
  if (batch_->canvas && shared_->parts.coarse)
    shared_->parts.coarse(batch_->canvas->finish(unsettled_until_ ? kUnknownError : 0.0f));
  if (batch_->light)
    begin_stored_light();
  else
    begin_batch();
}

// Reads the whole level: one slice, after those that filled it.
void RendererActor::begin_stored_light() {
  if (batch_->canvas) coarse_lost_share_ = mean_lost_share(*batch_);
  phase_ = Phase::kStoredLight;
  post_slices(batch_, {batch_->jobs.size() - 1}, &RendererActor::find_bright);
}

void RendererActor::find_bright(Shared& shared, Batch& batch, std::size_t) {
  if (batch.of_all)
    shared.parts.surfaces->find_bright(*batch.light);
  else if (shared.light)
    batch.light->give_bright(shared.light->bright());
  const BrightTexels& bright = batch.light->bright();
  const auto measures = measure_bright(bright, *shared.parts.store, batch.light->level());
  batch.wanted = bright_samples(measures, batch.first ? kFirstTolerance : kTolerance);
  if (batch.wanted > 0) batch.wanting = requests_of(bright);
}

void RendererActor::finish_stored_light() {  // no slice runs now
  shared_->metrics().set("darm_renderer_bright_texels", static_cast<double>(batch_->light->bright().size()));
  shared_->parts.surfaces->use_stored_light(batch_->light);
  shared_->light = batch_->light;
  if (shared_->parts.light) shared_->parts.light(batch_->light);
  learn_aim(!batch_->light->bright().empty());
  if (!batch_->wanting.empty()) coarse_.hurry(batch_->wanting, batch_->wanted);
  begin_batch();
}

void RendererActor::send_pictures() {
  std::vector<tile_scheduler::ShadedTile> tiles;
  for (std::size_t i = 0; i < batch_->jobs.size(); ++i) {
    const TileJob& job = batch_->jobs[i];
    JobResult& r = batch_->results[i];
    if (job.coarse) continue;
    if (r.picture && unsettled_until_) r.picture->error = std::max(r.picture->error, kUnknownError);
    if (!job.recall)
      schedule_.pictured(job.tile, r.picture ? r.picture->error : -1.0f,
                         r.picture && rare_light() ? r.picture->lost_share : 0.0f);
    else if (r.picture)
      schedule_.recalled(job.tile, r.picture->error, r.picture->samples);
    if (!r.picture) continue;
    tile_scheduler::ShadedTile shaded;
    shaded.tile = job.tile;
    shaded.version = ++picture_number_;
    shaded.error = r.picture->error;
    shaded.samples = r.picture->samples;
    shaded.image = std::move(r.picture->image);
    tiles.push_back(std::move(shaded));
  }
  shared_->metrics().count("darm_renderer_images_total", static_cast<double>(tiles.size()));
  if (!tiles.empty()) {
    std::vector<TileId> names;
    for (const auto& t : tiles) names.push_back(t.tile);
    if (!shared_->parts.scheduler.tell(tile_scheduler::TilesShaded(std::move(tiles)))) {
      shared_->metrics().count("darm_renderer_pictures_refused_total", static_cast<double>(names.size()));
      if (shared_->parts.scheduler)
        for (const TileId t : names) schedule_.forget_picture(t);
    }
  }
}

}  // namespace darm::renderer
