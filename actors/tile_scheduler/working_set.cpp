#include "actors/tile_scheduler/working_set.hpp"

#include <utility>

#include "actors/tile_scheduler/visibility.hpp"

namespace darm::tile_scheduler {

WorkingSet::WorkingSet(WorkingSetOptions options) : options_(options), passes_per_picture_(kPassesPerPicture) {}

void WorkingSet::start_pose(Microseconds now, int passes_per_picture) {
  if (passes_ > 0) {
    previous_ = std::move(current_);
    moved_at_ = now;
  }
  current_.clear();
  passes_ = 0;
  passes_per_picture_ = passes_per_picture;
}

void WorkingSet::add(const VisibleSet& samples, int passes) {
  current_.merge(samples);
  const int before = passes_;
  passes_ += passes;
  // Once every pixel has been looked at, no more guesses.
  if (before < passes_per_picture_ && passes_ >= passes_per_picture_) current_.forget_early();
}

void WorkingSet::adopt(const WorkingSet& other, bool moved, Microseconds now) {
  if (moved) start_pose(now, other.passes_per_picture_);
  current_ = other.current_;
  passes_ = other.passes_;
  passes_per_picture_ = other.passes_per_picture_;
}

bool WorkingSet::expire(Microseconds now) {
  if (previous_.tiles().empty() || now - moved_at_ < options_.keep_previous) return false;
  previous_.clear();
  return true;
}

std::vector<WeightedChain> WorkingSet::chains() const {
  std::vector<WeightedChain> out;
  out.reserve(current_.chains().size() + previous_.chains().size());
  const auto append = [](std::vector<WeightedChain>& to, const VisibleSet& set, float weight) {
    if (set.samples() <= 0) return;
    const auto per_sample = static_cast<float>(weight / set.samples());
    for (std::size_t i = 0; i < set.chains().size(); ++i) to.push_back({set.chains()[i], set.counts()[i] * per_sample});
  };
  append(out, current_, 1.0f);
  append(out, previous_, options_.previous_weight);
  if (previous_.chains().empty()) return out;
  // Joined: a chain of both poses comes once, with both weights.
  ChainIndex seen;
  seen.reserve(out.size());
  std::size_t kept = 0;
  for (const auto& item : out) {
    const auto number = seen.insert(item.chain);
    if (number == kept)
      out[kept++] = item;
    else
      out[number].weight += item.weight;
  }
  out.resize(kept);
  return out;
}

void WorkingSet::for_each_use(const std::function<void(TileId, const TileUse&)>& visit) const {
  for (const auto* set : {&current_, &previous_})
    for (std::size_t i = 0; i < set->tiles().size(); ++i) visit(set->tiles()[i], set->uses()[i]);
}

}  // namespace darm::tile_scheduler
