#include "actors/tile_scheduler/working_set.hpp"

#include <utility>

#include "actors/tile_scheduler/visibility.hpp"

namespace darm::tile_scheduler {

WorkingSet::WorkingSet(WorkingSetOptions options) : options_(options), passes_per_picture_(kPassesPerPicture) {}

void WorkingSet::start_pose(Microseconds now, int passes_per_picture, bool keep) {
  if (!keep) {
    previous_.clear();
    older_.clear();
  } else if (current_.samples() > 0) {
    const bool glanced = passes_ == 0 && previous_.samples() > 0;
    if (glanced && now - previous_at_ < options_.keep_previous) {
      previous_.merge(current_);
    } else {
      older_ = std::exchange(previous_, std::move(current_));
      if (!glanced) older_.clear();
      previous_at_ = now;
    }
    moved_at_ = now;
  }
  current_.clear();
  passes_ = 0;
  passes_per_picture_ = passes_per_picture;
}

void WorkingSet::add(VisibleSet samples, int passes) {
  if (current_.samples() <= 0 && current_.tiles().empty())
    current_ = std::move(samples);
  else
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
  if (previous_.samples() <= 0 || now - moved_at_ < options_.keep_previous) return false;
  previous_.clear();
  older_.clear();
  return true;
}

Seen WorkingSet::seen() const {
  Seen out{{{&current_, 1.0f}}, passes_ >= kTapPasses};
  const double before = previous_.samples() + older_.samples();
  for (const auto* set : {&previous_, &older_})
    if (set->samples() > 0)
      out.parts.push_back({set, options_.previous_weight * static_cast<float>(set->samples() / before)});
  return out;
}

}  // namespace darm::tile_scheduler
