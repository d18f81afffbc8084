// How soon a client's picture is good enough, beside tracing camera frames.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "actors/types/error.hpp"

namespace darm::bench {

struct TimeToQualityOptions {
  std::filesystem::path config;  ///< set-up; may be empty
  std::filesystem::path scene;
  std::vector<std::string> cameras;     ///< one client each, all at once
  std::vector<std::string> references;  ///< per camera: BASE of BASE.a.pfm and BASE.b.pfm; missing: rendered, kept
  std::filesystem::path state_dir;  ///< keeps layouts and references between runs; the radiance store is always empty
  double target_db = 30;
  double seconds = 20;
  double truth_seconds = 0;  ///< > 0: then light goes on for so long, and what it has become is the truth
  bool frames = true;        ///< trace camera frames beside
  double q = 0;              ///< 0: the set-up's
  std::uint32_t width = 1280;
  std::uint32_t height = 720;
};

/// Starts a daemon in this process with an empty radiance store, one client per camera through socket and codec; clock
/// from the first camera that is sent. Then draws what each client had received, and traces camera frames with the
/// same integrator, one camera after another, on all cores. Keys: seconds_atlas (until all clients are at the target),
/// seconds_frames (until all pictures are), ratio, series (per camera; its to_truth is the true error of light and
/// codec, beside it codec_rms and ceiling: the truth's own score against the reference, which is the error of
/// resolution).
[[nodiscard]] Result<nlohmann::json> time_to_quality(const TimeToQualityOptions& options);

}  // namespace darm::bench
