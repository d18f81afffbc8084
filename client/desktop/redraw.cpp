#include "client/desktop/redraw.hpp"

#include <algorithm>

namespace darm::client::desktop {
namespace {

constexpr double kStillAfterMs = 150;
// Share of time that pictures of a still view may take: the machine may be drawing for others, or lighting the scene.
constexpr double kStillShare = 0.35;

}  // namespace

void RedrawPace::drawn(double begin, double end) {
  draw_ms_ = std::max(0.0, end - begin);
  drew_until_ = end;
  due_ = news_ = false;
}

bool RedrawPace::moving(double now) const { return now - moved_at_ < kStillAfterMs; }

double RedrawPace::wait(double now) const {
  if (due_ || (news_ && moving(now))) return 0;
  if (!news_) return std::numeric_limits<double>::infinity();
  return std::max(0.0, drew_until_ + draw_ms_ * (1 / kStillShare - 1) - now);
}

}  // namespace darm::client::desktop
