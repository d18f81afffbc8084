#include "tests/bench/darm_bench/ray_recorder.hpp"

namespace {

thread_local darm::bench::RecordedRays* recording = nullptr;

void record(const RTCRay& ray, bool occlusion) {
  if (recording == nullptr) return;
  recording->push_back(
      {{ray.org_x, ray.org_y, ray.org_z}, ray.tnear, {ray.dir_x, ray.dir_y, ray.dir_z}, ray.tfar, occlusion});
}

}  // namespace

// Names that the linker gives and asks for: __wrap_ stands in for the function, __real_ is the function.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" {
void __real_rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* query);
void __real_rtcOccluded1(RTCScene scene, RTCIntersectContext* context, RTCRay* query);

void __wrap_rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* query) {
  record(query->ray, false);
  __real_rtcIntersect1(scene, context, query);
}
void __wrap_rtcOccluded1(RTCScene scene, RTCIntersectContext* context, RTCRay* query) {
  record(*query, true);
  __real_rtcOccluded1(scene, context, query);
}
}

namespace darm::bench {

RayRecorder::RayRecorder(RecordedRays& rays) { recording = &rays; }
RayRecorder::~RayRecorder() { recording = nullptr; }

std::uint64_t trace_bare(const BareScene& scene, const RecordedRays& rays) {
  std::uint64_t hits = 0;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (const auto& r : rays) {
    RTCRayHit query;
    query.ray = {r.origin[0], r.origin[1], r.origin[2], r.tmin, r.direction[0], r.direction[1], r.direction[2], 0.0f,
                 r.tmax,      ~0u,         0u,          0u};
    if (r.occlusion) {
      __real_rtcOccluded1(scene.scene(), &context, &query.ray);
      hits += query.ray.tfar < 0 ? 1 : 0;
    } else {
      query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      __real_rtcIntersect1(scene.scene(), &context, &query);
      hits += query.hit.geomID != RTC_INVALID_GEOMETRY_ID ? 1 : 0;
    }
  }
  return hits;
}

}  // namespace darm::bench
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)
