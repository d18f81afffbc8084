#include "actors/tile_scheduler/trace_budget.hpp"

#include <algorithm>
#include <cmath>

namespace darm::tile_scheduler {
namespace {

constexpr double kRayLearned = 0.2;  // weight of the newest trace
constexpr double kLeastRayUs = 0.01, kMostRayUs = 100;
constexpr double kMostDebtSeconds = 2;  // of the budget: what many moving views took is not paid off for ever

}  // namespace

TraceBudget::TraceBudget(double processors, double moving)
    : processors_(std::isfinite(processors) ? std::max(processors, 1e-3) : 1.0),
      moving_(std::isfinite(moving) ? std::max(moving, 1e-3) : 1.0) {}

// Nothing is saved up: a pause does not allow a burst.
void TraceBudget::pay(Microseconds now) {
  const auto passed = std::max<Microseconds>(0, now - paid_at_);
  paid_at_ = std::max(paid_at_, now);
  debt_us_ = std::max(0.0, debt_us_ - processors_ * static_cast<double>(passed));
}

bool TraceBudget::allows(Microseconds now) {
  pay(now);
  return debt_us_ <= 0;
}

void TraceBudget::begin(std::uint64_t rays, Microseconds now) {
  pay(now);
  debt_us_ = std::min(debt_us_ + static_cast<double>(rays) * ray_us_, processors_ * kMostDebtSeconds * 1e6);
}

std::uint32_t TraceBudget::glance(std::size_t moving, Microseconds period) const {
  const double each = moving_ * static_cast<double>(std::max<Microseconds>(period, 1)) /
                      (static_cast<double>(std::max<std::size_t>(moving, 1)) * ray_us_);
  return static_cast<std::uint32_t>(std::clamp(each, double{kLeastGlance}, 4e9));
}

void TraceBudget::end(std::uint64_t rays, Microseconds busy) {
  if (rays == 0) return;
  const double took = static_cast<double>(std::max<Microseconds>(0, busy));
  debt_us_ = std::max(0.0, debt_us_ + took - static_cast<double>(rays) * ray_us_);
  const double each = std::clamp(took / static_cast<double>(rays), kLeastRayUs, kMostRayUs);
  ray_us_ += kRayLearned * (each - ray_us_);
}

}  // namespace darm::tile_scheduler
