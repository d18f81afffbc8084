// Every ray that code of the product hands to the ray library, as it was handed over. The program is linked so that
// calls of rtcIntersect1 and rtcOccluded1 pass here first (ld --wrap): the product's code knows nothing of it.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/bench/bare_scene.hpp"

namespace darm::bench {

struct RecordedRay {
  float origin[3], tmin, direction[3], tmax;
  bool occlusion;  ///< asked for any hit; else for the closest
};

using RecordedRays = std::vector<RecordedRay>;

/// While it lives, the rays of the calling thread are added to `rays`, from what the vector has reserved on without
/// allocation.
class RayRecorder {
 public:
  explicit RayRecorder(RecordedRays& rays);
  ~RayRecorder();
  RayRecorder(const RayRecorder&) = delete;
  RayRecorder& operator=(const RayRecorder&) = delete;
};

/// Traces the rays again, in order, and nothing else. Returns how many hit something.
std::uint64_t trace_bare(const BareScene& scene, const RecordedRays& rays);

}  // namespace darm::bench
