// Who the clients are: which of them are slow, vanish, jump about, decode or draw, and where each stands. Pure.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string_view>
#include <vector>

#include "client/core/result.hpp"

namespace darm::client::load {

enum class Role : std::uint8_t {
  kHealthy,
  kSlow,         ///< reads a few bytes a second
  kVanishing,    ///< is gone one moment without a word
  kTeleporting,  ///< looks from somewhere else every second
  kStalling,     ///< its line carries nothing for some seconds
};
inline constexpr std::size_t kRoles = 5;
[[nodiscard]] std::string_view to_string(Role role);

struct CrowdShape {
  std::uint32_t clients = 1;
  std::uint32_t draw = 0;    ///< decode, and draw once a second
  std::uint32_t decode = 0;  ///< decode; the others look at bytes alone
  std::uint32_t slow = 0, vanish = 0, teleport = 0;
  std::uint32_t stall = 0;   ///< the first of all, so that they may be those that draw
  std::uint32_t places = 1;  ///< groups, at least 1
  double churn = 0;          ///< healthy clients that do not decode leave, and others come, so many a second
  double spread = 0.5;       ///< metres
  std::uint64_t seed = 1;
};

struct ClientPlan {
  std::uint32_t index = 0;
  std::uint32_t group = 0;  ///< 0 .. places - 1
  Role role = Role::kHealthy;
  bool decodes = false;  ///< as do those that draw
  bool draws = false;
  glm::dvec3 shift{0.0};  ///< from the group's place, metres
  double late = 0;        ///< seconds behind the group on its way, 0..1
  std::uint64_t seed = 1;
};

/// Those that draw and decode come first and are healthy or stall, the other ill-behaved last; groups take turns, so
/// that each has its share of every kind. Positions lie within a flat ellipsoid of radius `spread`. Error: more roles
/// than clients, or nobody to leave though some should.
[[nodiscard]] Result<std::vector<ClientPlan>> plan_crowd(const CrowdShape& shape);

/// A number of [0, 1) for `seed` and `what`, always the same.
[[nodiscard]] double chance(std::uint64_t seed, std::uint64_t what);

}  // namespace darm::client::load
