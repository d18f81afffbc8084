// What a run against camera frames needs before its clock starts: scene, views, references.
#pragma once

#include <vector>

#include "actors/renderer/reference_renderer.hpp"
#include "client/core/connection.hpp"
#include "client/core/image_metrics.hpp"
#include "daemon/world.hpp"
#include "tests/bench/darm_bench/time_to_quality.hpp"

namespace darm::bench {

struct Setting {
  config::Config config;  ///< of a daemon on free ports of 127.0.0.1
  World world;            ///< its store is closed: a daemon of the same state directory opens its own
  unsigned threads = 1;
  std::vector<client::View> views;            ///< one a camera
  std::vector<renderer::ReferenceJob> jobs;   ///< of each view; their seeds are not the reference's
  std::vector<client::Reference> references;  ///< read, or rendered once and kept
};

/// Leaves the state directory without radiance stores, but with the layout.
[[nodiscard]] Result<Setting> prepare(const TimeToQualityOptions& options);

}  // namespace darm::bench
