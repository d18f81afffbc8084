#include "client/desktop/frame_guard.hpp"

#include <algorithm>
#include <cmath>

namespace darm::client::desktop {
namespace {

constexpr double kBudgetMs = 33;  // of a picture while something moves
// One slow picture may be a shader's first use; a finer step is taken on long evidence, so that nothing flickers.
constexpr int kSlowInARow = 2;
constexpr int kQuickInARow = 45;
constexpr double kSpare = 0.8;  // share of the budget that the finer picture may be expected to take

}  // namespace

// Work goes with the pixels, the square of what is on a side.
void FrameGuard::drawn(std::uint32_t divisor, double ms) {
  if (divisor != divisor_ || !std::isfinite(ms)) return;
  if (ms > kBudgetMs) {
    quick_ = 0;
    if (++slow_ < kSlowInARow) return;
    slow_ = 0;
    const double wanted = std::ceil(divisor_ * std::sqrt(ms / kBudgetMs));
    divisor_ = static_cast<std::uint32_t>(std::clamp(wanted, divisor_ + 1.0, double{kCoarsest}));
    return;
  }
  slow_ = 0;
  if (divisor_ == 1) return;
  const double finer = divisor_ / (divisor_ - 1.0);
  quick_ = ms * finer * finer < kSpare * kBudgetMs ? quick_ + 1 : 0;
  if (quick_ < kQuickInARow) return;
  quick_ = 0;
  --divisor_;
}

}  // namespace darm::client::desktop
