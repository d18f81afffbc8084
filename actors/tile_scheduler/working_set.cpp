#include "actors/tile_scheduler/working_set.hpp"

#include <utility>

#include "actors/tile_scheduler/visibility.hpp"

namespace darm::tile_scheduler {

WorkingSet::WorkingSet(WorkingSetOptions options) : options_(options), passes_per_picture_(kPassesPerPicture) {}

VisibleSet& WorkingSet::own() {
  if (!alone()) current_ = std::make_shared<VisibleSet>(*current_);
  return *current_;
}

void WorkingSet::start_pose(Microseconds now, int passes_per_picture, bool keep) {
  if (!keep) {
    previous_.clear();
    older_.clear();
  } else if (current_->samples() > 0) {
    const bool glanced = passes_ == 0 && previous_.samples() > 0;
    if (glanced && now - previous_at_ < options_.keep_previous) {
      previous_.merge(*current_);
    } else {
      older_ = std::exchange(previous_, alone() ? std::move(*current_) : *current_);
      if (!glanced) older_.clear();
      previous_at_ = now;
    }
    moved_at_ = now;
  }
  current_ = std::make_shared<VisibleSet>();
  passes_ = 0;
  passes_per_picture_ = passes_per_picture;
}

void WorkingSet::add(VisibleSet samples, int passes) {
  const auto nothing = [](const VisibleSet& set) { return set.samples() <= 0 && set.tiles().empty(); };
  if (nothing(*current_))
    current_ = std::make_shared<VisibleSet>(std::move(samples));
  else if (!nothing(samples))
    own().merge(samples);
  const int before = passes_;
  passes_ += passes;
  // Once every pixel has been looked at, no more guesses.
  if (before < passes_per_picture_ && passes_ >= passes_per_picture_) own().forget_early();
}

void WorkingSet::adopt(const WorkingSet& other, bool moved, Microseconds now) {
  if (moved) start_pose(now, other.passes_per_picture_);
  current_ = other.current_;
  passes_ = other.passes_;
  passes_per_picture_ = other.passes_per_picture_;
}

bool WorkingSet::expire(Microseconds now) {
  if (previous_.samples() <= 0 || now - moved_at_ < options_.keep_previous) return false;
  previous_.clear();
  older_.clear();
  return true;
}

Seen WorkingSet::seen() const {
  Seen out{{{current_.get(), 1.0f}}, passes_ >= kTapPasses};
  const double before = previous_.samples() + older_.samples();
  for (const auto* set : {&previous_, &older_})
    if (set->samples() > 0)
      out.parts.push_back({set, options_.previous_weight * static_cast<float>(set->samples() / before)});
  return out;
}

}  // namespace darm::tile_scheduler
