// A whole study of one scene: references, variants, what is kept between runs.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "actors/types/camera.hpp"
#include "actors/types/error.hpp"
#include "daemon/accuracy/report/measurement.hpp"
#include "daemon/config/config.hpp"
#include "daemon/progress.hpp"

namespace darm::accuracy {

struct StudyOptions {
  config::Config config;
  std::vector<std::string> cameras;  ///< SPECs; empty: the first of the set-up, or where a client would start
  std::vector<std::string> only;     ///< groups or variants; empty: all
  std::filesystem::path out;         ///< results.jsonl is here; also where what is temporary lies
  Viewport viewport;
  double seconds = 16;            ///< of an atlas run
  double reference_psnr = 40;     ///< the references' own accuracy, dB
  std::function<bool()> stopped;  ///< asked often, from any thread
};

struct Study {
  Report report;
  std::size_t measured = 0;  ///< in this run
  std::size_t kept = 0;      ///< taken from earlier runs
  std::size_t left_out = 0;  ///< could not be measured; why has been said
  bool stopped = false;      ///< `stopped` said so; what was done is in the file and in the report
};

/// Measures what results.jsonl in `out` does not hold yet and adds each result as soon as it is there. Results count
/// for the scene, set-up and method they were made with: after a change they are made anew. Results of other variants
/// of the same set-up are in the report too. Errors: scene, camera, a folder that cannot be written, a run that failed;
/// and that nothing at all could be measured, nor had been before.
[[nodiscard]] Result<Study> run_study(const StudyOptions& options, Progress& progress);

}  // namespace darm::accuracy
