#include "actors/renderer/tile_schedule.hpp"

#include <algorithm>
#include <cmath>

namespace darm::renderer {

namespace {
constexpr std::uint32_t kSurveyCost = 40;  // samples' worth of time
constexpr double kHiddenShare = 0.02;      // weight of tiles that serve only as borders
constexpr double kFirstGain = 0.0003;  // of a first pass, for each level that the coarse one is coarser twice as much
constexpr double kTileCost = 300;      // samples' worth of time for a tile's map, facts and picture
constexpr float kBorrows = 0.1f;       // of a tile's light
constexpr float kLeastForTarget = 16;  // an error estimate of fewer samples is not believed
}  // namespace

TileSchedule::TileSchedule(std::vector<LevelTiles> levels, const ScheduleOptions& options)
    : levels_(std::move(levels)), options_(options) {
  options_.publish_growth = std::max(options_.publish_growth, 1.01f);
  options_.max_samples = std::clamp(options_.max_samples, 1u, 1u << 22);
  options_.job_samples = std::max(options_.job_samples, 1u);
}

void TileSchedule::replace(const std::vector<TileRequest>& work, const std::function<bool(TileId)>& stored) {
  std::unordered_map<TileId, State> next;
  next.reserve(work.size());
  for (const auto& request : work) {
    State s;
    if (const auto it = tiles_.find(request.tile); it != tiles_.end()) {
      s = it->second;
      TexelMask both = s.mask;
      both |= request.mask;
      if (!(both == s.mask)) s.surveyed = false;
      if (!request.display) s.pictured_mean = -1;
    }
    s.mask = request.mask;
    s.weight = std::isfinite(request.weight) ? std::max(request.weight, 0.0f) : 0.0f;
    s.display = request.display;
    s.target_error = request.target_error;
    s.stored = s.stored || stored(request.tile);
    next.insert_or_assign(request.tile, s);
  }
  tiles_ = std::move(next);
}

// Its neighbours in the atlas, without itself.
std::vector<TileId> TileSchedule::beside_of(TileId tile) const {
  std::vector<TileId> out;
  if (static_cast<std::size_t>(tile.level()) >= levels_.size()) return out;
  for (int d = 0; d < 9; ++d) {
    const auto other = neighbour_of(tile, levels_[static_cast<std::size_t>(tile.level())], d % 3 - 1, d / 3 - 1);
    if (other && *other != tile) out.push_back(*other);
  }
  return out;
}

bool TileSchedule::on_target(const State& s) const {
  return s.target_error > 0 && s.error >= 0 && s.error <= s.target_error && s.progress.unshaded == 0 &&
         s.pictured_mean >= kLeastForTarget;
}

bool TileSchedule::finished(TileId tile, const State& s) const {
  if (s.progress.texels == 0 || s.progress.least >= static_cast<float>(options_.max_samples)) return true;
  if (s.display) return on_target(s);
  // It has no picture, so no error of its own: it is as exact as those it borders need.
  if (!(s.target_error > 0) || s.progress.mean < kLeastForTarget) return false;
  return std::ranges::none_of(beside_of(tile), [&](TileId beside) {
    const auto it = tiles_.find(beside);
    return it != tiles_.end() && it->second.display && !on_target(it->second);
  });
}

TileSchedule::Need TileSchedule::need_of(TileId tile, const State& s) const {
  if (s.quarantined || s.mask.empty()) return Need::kNothing;
  if (!s.surveyed) return s.stored ? Need::kSurvey : Need::kFirst;
  if (s.progress.unshaded > 0) return Need::kFirst;
  return finished(tile, s) ? Need::kNothing : Need::kMore;
}

// Weight times the fall of squared display error, over the price in samples. A first pass takes the place of the coarse
// level: the more levels that is away, the more it gains. A later pass over texels that have n samples takes about
// 1 / (n + 1) of their variance away (after a first pass n is a quarter), and draws both layers.
double TileSchedule::gain_of(TileId tile, const State& s, Need need) const {
  const double weight = (s.display ? 1.0 : kHiddenShare) * (double{s.weight} + 1e-9);
  const double texels = std::max(1.0, double(s.surveyed ? s.progress.texels : s.mask.count()));
  if (need == Need::kFirst) {
    const int coarser = static_cast<int>(levels_.size()) - 1 - tile.level();
    return weight * kFirstGain * std::exp2(coarser) / (kTileCost + 1.25 * texels);
  }
  const double n = std::max(double{s.progress.mean}, 0.25);
  const double error =
      s.error > 0 ? s.error * std::sqrt(std::max(double{s.pictured_mean}, 0.25) / n) : 0.3 / std::sqrt(n);
  return weight * error * error / ((n + 1) * (0.5 * kTileCost + 2 * texels));
}

TileJob TileSchedule::job_for(TileId tile, const State& s, Need need) const {
  TileJob job;
  job.tile = tile;
  job.mask = s.mask;
  job.most = options_.max_samples;
  if (need == Need::kSurvey) {
    job.cost = kSurveyCost;
  } else if (need == Need::kFirst) {
    job.passes = 1;
    job.cost = (s.surveyed ? s.progress.unshaded : static_cast<std::uint32_t>(s.mask.count())) * 5 / 4;
  } else {
    const std::uint32_t fit = options_.job_samples / std::max(s.progress.texels, 1u);
    const auto half = static_cast<std::uint32_t>(s.progress.least / 2);
    job.passes = std::max(1u, std::min(fit, half));
    job.cost = 2 * job.passes * s.progress.texels;  // both layers
  }
  job.cost = std::max(job.cost, 1u);
  return job;
}

std::vector<TileJob> TileSchedule::next_batch(std::uint64_t samples) {
  struct Candidate {
    Need need;
    double gain;
    TileId tile;
    const State* state;
  };
  std::vector<Candidate> candidates;
  candidates.reserve(tiles_.size());
  for (const auto& [tile, state] : tiles_)
    if (const Need need = need_of(tile, state); need != Need::kNothing)
      candidates.push_back({need, gain_of(tile, state, need), tile, &state});
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    if ((a.need == Need::kSurvey) != (b.need == Need::kSurvey)) return a.need == Need::kSurvey;
    if (a.gain != b.gain) return a.gain > b.gain;
    return a.tile < b.tile;  // the same order on every run
  });
  std::vector<TileJob> jobs;
  std::uint64_t taken = 0;
  for (const auto& c : candidates) {
    if (taken >= samples) break;
    // What is stored is shown before anything is computed.
    if ((c.need == Need::kSurvey) != (candidates.front().need == Need::kSurvey)) break;
    jobs.push_back(job_for(c.tile, *c.state, c.need));
    taken += jobs.back().cost;
  }
  return jobs;
}

void TileSchedule::shaded(TileId tile, const TileProgress& progress, std::uint32_t samples) {
  const auto it = tiles_.find(tile);
  if (it == tiles_.end()) return;
  State& s = it->second;
  if (samples > 0 && (!s.surveyed || s.progress.unshaded > 0)) s.fresh_texels = true;
  // Texels that somebody else had shaded: their light is there, the picture was drawn without knowing their albedo.
  if (s.pictured_mean >= 0 && !s.recalled && !s.shown.contains(s.mask)) s.fresh_texels = true;
  s.progress = progress;
  s.surveyed = true;
  s.stored = s.stored || samples > 0;
  s.failures = 0;
  if (progress.mean <= 0 || progress.mean < s.told_mean * options_.publish_growth) return;
  const bool first_light = s.told_mean <= 0;
  s.told_mean = progress.mean;
  for (const auto beside : beside_of(tile)) {
    const auto n = tiles_.find(beside);
    if (n == tiles_.end() || n->second.pictured_mean < 0) continue;
    n->second.stale_border = n->second.stale_border || first_light || n->second.borrows;
  }
}

bool TileSchedule::failed(TileId tile) {
  const auto it = tiles_.find(tile);
  if (it == tiles_.end()) return true;
  if (++it->second.failures < 2) return true;
  it->second.quarantined = true;
  return false;
}

std::vector<TileId> TileSchedule::pictures_due() const {
  std::vector<TileId> due;
  std::vector<TileId> borders;
  bool calm = true;
  for (const auto& [tile, s] : tiles_) {
    const Need need = need_of(tile, s);
    calm = calm && need != Need::kFirst && need != Need::kSurvey;
    if (!s.display || s.quarantined || s.progress.mean <= 0) continue;
    const bool last = need == Need::kNothing && s.progress.mean > s.pictured_mean * 1.05f;
    if (s.pictured_mean < 0 || s.fresh_texels || last || s.progress.mean >= s.pictured_mean * options_.publish_growth)
      due.push_back(tile);
    else if (s.stale_border)
      (s.borrows ? due : borders).push_back(tile);
  }
  if (calm) due.insert(due.end(), borders.begin(), borders.end());
  std::sort(due.begin(), due.end());  // neighbours together: their light is in the cache
  return due;
}

void TileSchedule::pictured(TileId tile, float error, float lost_share) {
  const auto it = tiles_.find(tile);
  if (it == tiles_.end()) return;
  State& s = it->second;
  s.pictured_mean = s.progress.mean;
  s.error = error;
  s.shown |= s.mask;
  s.recalled = false;
  s.fresh_texels = false;
  s.stale_border = false;
  s.borrows = lost_share > kBorrows;
}

std::vector<TileId> TileSchedule::recalls_due() {
  std::vector<TileId> due;
  for (auto& [tile, s] : tiles_) {
    if (s.asked_store || !s.display || !s.stored || s.pictured_mean >= 0) continue;
    s.asked_store = true;
    due.push_back(tile);
  }
  std::sort(due.begin(), due.end());
  return due;
}

void TileSchedule::recalled(TileId tile, float error, float samples) {
  const auto it = tiles_.find(tile);
  if (it == tiles_.end()) return;
  it->second.pictured_mean = samples;
  it->second.error = error;
  it->second.recalled = true;
}

void TileSchedule::forget_picture(TileId tile) {
  if (const auto it = tiles_.find(tile); it != tiles_.end()) it->second.pictured_mean = -1;
}

const TexelMask* TileSchedule::mask_of(TileId tile) const {
  const auto it = tiles_.find(tile);
  return it == tiles_.end() ? nullptr : &it->second.mask;
}

}  // namespace darm::renderer
