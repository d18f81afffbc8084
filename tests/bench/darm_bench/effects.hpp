// What the effect plan saves over an integrator with everything on, and what each effect costs.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "actors/types/error.hpp"

namespace darm::bench {

struct EffectsOptions {
  std::filesystem::path config;  ///< set-up; may be empty
  std::filesystem::path scene;
  std::string camera;  ///< empty: where a client starts
  double seconds = 4;  ///< of each comparison
};

/// Keys: value (paths a second, one thread, of the planned integrator), peer (of the one with everything on, the same
/// paths in turn), ratio, quartiles, different (paths whose light is not the same, bit by bit), filters_everywhere (the
/// same against rays that also call back for every triangle), effects (per effect: needed, reason, and for those that
/// can be taken out the time of a path with it over without it).
[[nodiscard]] Result<nlohmann::json> effects(const EffectsOptions& options);

}  // namespace darm::bench
