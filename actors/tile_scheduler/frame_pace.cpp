#include "actors/tile_scheduler/frame_pace.hpp"

#include <algorithm>
#include <cmath>

namespace darm::tile_scheduler {
namespace {

constexpr double kFrameLearned = 0.1;  // weight of the newest frame
constexpr double kMostUs = 200'000;    // a frame that took longer was held up by something else

}  // namespace

FramePace::FramePace(double processors, Microseconds longest)
    : processors_(std::isfinite(processors) ? std::max(processors, 1e-3) : 1.0),
      longest_us_(static_cast<double>(longest)) {}

void FramePace::done(Microseconds busy) {
  if (busy <= 0) return;
  frame_us_ += kFrameLearned * (std::min(static_cast<double>(busy), kMostUs) - frame_us_);
}

Microseconds FramePace::interval(std::size_t streams, bool moving) const {
  if (streams <= 1) return 0;
  const double each = frame_us_ * static_cast<double>(streams) / processors_;
  return static_cast<Microseconds>(std::min(moving ? each / 2 : each, longest_us_));
}

}  // namespace darm::tile_scheduler
