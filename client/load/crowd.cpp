#include "client/load/crowd.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "client/load/split_mix.hpp"

namespace darm::client::load {
namespace {

constexpr double kHeightShare = 0.2;  // of the spread: people differ less in height than in place

// Even over the volume of the ellipsoid.
glm::dvec3 shift_of(std::uint64_t seed, double spread) {
  const double turn = 2 * std::numbers::pi * chance(seed, 1), up = 2 * chance(seed, 2) - 1;
  const double radius = spread * std::cbrt(chance(seed, 3)), level = std::sqrt(1 - up * up);
  return {radius * level * std::cos(turn), radius * up * kHeightShare, radius * level * std::sin(turn)};
}

Role role_of(const CrowdShape& shape, std::uint32_t index) {
  const std::uint32_t from_last = shape.clients - 1 - index;
  if (from_last < shape.slow) return Role::kSlow;
  if (from_last < shape.slow + shape.vanish) return Role::kVanishing;
  if (from_last < shape.slow + shape.vanish + shape.teleport) return Role::kTeleporting;
  if (index < shape.stall) return Role::kStalling;
  return Role::kHealthy;
}

}  // namespace

std::string_view to_string(Role role) {
  constexpr std::array<std::string_view, kRoles> kNames = {"healthy", "slow", "vanishing", "teleporting", "stalling"};
  return kNames[static_cast<std::size_t>(role)];
}

double chance(std::uint64_t seed, std::uint64_t what) {
  const std::uint64_t x = seed * 0x9e3779b97f4a7c15u + what * 0xd1342543de82ef95u + 0x9e3779b97f4a7c15u;
  return static_cast<double>(split_mix(x) >> 11) * 0x1p-53;
}

Result<std::vector<ClientPlan>> plan_crowd(const CrowdShape& shape) {
  const auto first = std::max(std::uint64_t{shape.draw} + shape.decode, std::uint64_t{shape.stall});
  const std::uint64_t needed = first + shape.slow + shape.vanish + shape.teleport;
  if (needed > shape.clients) {
    return fail(
        fmt::format("--clients {}: --draw and --decode (or --stall), --slow, --vanish and --teleport together "
                    "name {}",
                    shape.clients, needed));
  }
  if (shape.churn > 0 && needed == shape.clients) {
    return fail(fmt::format("--churn {}: only clients that neither decode nor misbehave leave, and of {} there is none",
                            shape.churn, shape.clients));
  }
  std::vector<ClientPlan> crowd(shape.clients);
  for (std::uint32_t i = 0; i < shape.clients; ++i) {
    auto& plan = crowd[i];
    plan.index = i;
    plan.group = i % shape.places;
    plan.role = role_of(shape, i);
    plan.draws = i < shape.draw;
    plan.decodes = i < shape.draw + shape.decode;
    plan.seed = shape.seed * 1'000'003 + i;
    plan.shift = shift_of(plan.seed, shape.spread);
    plan.late = chance(plan.seed, 4);
  }
  return crowd;
}

}  // namespace darm::client::load
