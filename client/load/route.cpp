#include "client/load/route.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

namespace darm::client::load {
namespace {

constexpr double kSearchStep = 0.05;  // seconds of a walkthrough
constexpr std::size_t kMostSteps = 100'000;

CameraKey shifted(CameraKey key, const glm::dvec3& by) {
  key.position += by;
  key.target += by;
  return key;
}

// When the path is nearest to where `place` is and looks.
double nearest_time(const std::vector<CameraKey>& path, const CameraKey& place) {
  const double first = path.front().t, length = path.back().t - first;
  const auto steps = static_cast<std::size_t>(std::clamp(length / kSearchStep, 1.0, double{kMostSteps}));
  double best = first, least = INFINITY;
  for (std::size_t i = 0; i <= steps; ++i) {
    const double t = first + length * static_cast<double>(i) / static_cast<double>(steps);
    const auto key = camera_at(path, t);
    const glm::dvec3 off = key.position - place.position, aside = key.target - place.target;
    const double distance = glm::dot(off, off) + 0.1 * glm::dot(aside, aside);
    if (distance < least) {
      least = distance;
      best = t;
    }
  }
  return best - first;
}

}  // namespace

Route::Route(std::vector<CameraKey> walkthrough, std::vector<CameraKey> places, std::uint32_t clients)
    : walkthrough_(std::move(walkthrough)), places_(std::move(places)), clients_(std::max(clients, 1u)) {
  if (walkthrough_.empty()) return;
  for (const auto& place : places_) starts_.push_back(nearest_time(walkthrough_, place));
}

// There and back again, so that nobody jumps at the end.
CameraKey Route::walked(double seconds) const {
  const double twice = 2 * std::max(length(), 1e-6);
  double t = std::fmod(std::max(seconds, 0.0), twice);
  if (t > twice / 2) t = twice - t;
  return camera_at(walkthrough_, walkthrough_.front().t + t);
}

CameraKey Route::elsewhere(std::uint64_t seed, std::uint64_t jump) const {
  const double a = chance(seed, 1000 + 2 * jump), b = chance(seed, 1001 + 2 * jump);
  CameraKey key =
      walkthrough_.empty()
          ? places_[std::min(static_cast<std::size_t>(a * static_cast<double>(places_.size())), places_.size() - 1)]
          : walked(a * length());
  // And turned about the upright axis: what was seen before is behind.
  const double turn = 6.283185307179586 * b;
  const glm::dvec3 ahead = key.target - key.position;
  key.target = key.position + glm::dvec3(ahead.x * std::cos(turn) + ahead.z * std::sin(turn), ahead.y,
                                         ahead.z * std::cos(turn) - ahead.x * std::sin(turn));
  return key;
}

std::optional<CameraKey> Route::at(const ClientPlan& plan, double seconds) const {
  if (walkthrough_.empty() && places_.empty()) return std::nullopt;
  if (plan.role == Role::kTeleporting)
    return shifted(elsewhere(plan.seed, static_cast<std::uint64_t>(std::max(seconds + plan.late, 0.0))), plan.shift);
  if (walkthrough_.empty()) return shifted(places_[plan.group % places_.size()], plan.shift);
  const double start = starts_.empty() ? length() * plan.index / clients_ : starts_[plan.group % starts_.size()];
  return shifted(walked(start + plan.late + seconds), plan.shift);
}

}  // namespace darm::client::load
