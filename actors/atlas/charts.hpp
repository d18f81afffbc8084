// The parameterised surface of the whole scene: charts, and which instance uses which.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/scene/scene.hpp"
#include "actors/types/error.hpp"

namespace darm::atlas {

/// Called now and then with a fraction in [0, 1]; from the calling thread or another, one call at a time.
using Progress = std::function<void(std::string_view stage, float fraction)>;

struct Charts {
  std::vector<Chart> charts;
  std::vector<InstanceCharts> instances;  ///< parallel to Scene::instances
  std::uint32_t patch_count = 0;
  double surface_area = 0;                ///< world units squared, back sides included
  std::vector<DroppedTriangles> dropped;  ///< counted per instance
};

/// Parameterises every mesh once per distinct stretch of its instances. The result does not depend on `threads`.
[[nodiscard]] Result<Charts> build_charts(const scene::Scene& scene, unsigned threads, const Progress& progress);

}  // namespace darm::atlas
