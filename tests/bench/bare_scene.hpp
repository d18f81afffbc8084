// The ray library alone, as the limit of what a renderer on it can reach: the same triangles and settings, no filters,
// no checks, no reading of hits. What uses it links embree.
#pragma once

#include <embree3/rtcore.h>

#include <cstdint>

#include "actors/renderer/trace/ray_scene.hpp"

namespace darm::bench {

class BareScene {
 public:
  explicit BareScene(const renderer::trace::RayScene& rays)
      : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    for (std::uint32_t i = 0; i < rays.instance_count(); ++i) {
      const auto& placed = rays.instance(i);
      if (placed.mesh->triangles.empty()) continue;
      RTCGeometry g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
      rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, placed.positions, 0, 12,
                                 placed.mesh->positions.size());
      rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, placed.mesh->triangles.data(), 0, 12,
                                 placed.mesh->triangles.size());
      rtcSetGeometryBuildQuality(g, RTC_BUILD_QUALITY_HIGH);
      rtcCommitGeometry(g);
      rtcAttachGeometryByID(scene_, g, i);
      rtcReleaseGeometry(g);
    }
    rtcCommitScene(scene_);
  }
  ~BareScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  BareScene(const BareScene&) = delete;
  BareScene& operator=(const BareScene&) = delete;

  [[nodiscard]] RTCScene scene() const { return scene_; }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace darm::bench
