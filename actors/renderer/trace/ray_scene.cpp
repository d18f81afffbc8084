#include "actors/renderer/trace/ray_scene.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <string>

#include "actors/renderer/trace/effect_tally.hpp"
#include "actors/renderer/trace/surface.hpp"

#if defined(__linux__)
#include <sys/mman.h>
#endif
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace darm::renderer::trace {

struct RayScene::Device {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  ~Device() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

namespace {

bool finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

bool is_traceable(const Ray& ray) {
  // One sum catches NaN and infinity of all six numbers: any of them makes it non-finite, and so does overflow, which
  // the exact test below then judges.
  const float sum = ray.origin.x + ray.origin.y + ray.origin.z + ray.direction.x + ray.direction.y + ray.direction.z;
  if (!std::isfinite(sum) && !(finite(ray.origin) && finite(ray.direction))) return false;
  return !std::isnan(ray.tmin) && ray.tmin <= ray.tmax && glm::dot(ray.direction, ray.direction) > 0;
}

// Filters are only ever called for single rays (N == 1): this file makes no packet query.
void pass_masked(const RTCFilterFunctionNArguments* args) {
  if (args->valid[0] == 0) return;
  const auto& instance = *static_cast<const RayScene*>(args->geometryUserPtr);
  const auto id = RTCHitN_geomID(args->hit, args->N, 0);
  const auto& placed = instance.instance(id);
  thread_tally().add(EffectKind::kAlphaTest);
  if (placed.material->alpha_mode != scene::AlphaMode::kMask) return;
  const float alpha = surface_alpha(instance.scene(), placed, RTCHitN_primID(args->hit, args->N, 0),
                                    RTCHitN_u(args->hit, args->N, 0), RTCHitN_v(args->hit, args->N, 0));
  if (alpha < placed.material->alpha_cutoff) args->valid[0] = 0;
}

struct CameraContext {
  RTCIntersectContext base;
  const RayScene* scene;
};

float facing(const RTCFilterFunctionNArguments* args) {
  return RTCHitN_Ng_x(args->hit, args->N, 0) * RTCRayN_dir_x(args->ray, args->N, 0) +
         RTCHitN_Ng_y(args->hit, args->N, 0) * RTCRayN_dir_y(args->ray, args->N, 0) +
         RTCHitN_Ng_z(args->hit, args->N, 0) * RTCRayN_dir_z(args->ray, args->N, 0);
}

void pass_single_sided_backs(const RTCFilterFunctionNArguments* args) {
  if (args->valid[0] == 0) return;
  const auto* context = reinterpret_cast<const CameraContext*>(args->context);
  const auto& placed = context->scene->instance(RTCHitN_geomID(args->hit, args->N, 0));
  if (placed.material->double_sided) return;
  if (facing(args) * placed.handedness > 0) args->valid[0] = 0;
}

RTCRayHit to_embree(const Ray& ray) {
  RTCRayHit query;
  query.ray = {
      ray.origin.x, ray.origin.y, ray.origin.z, ray.tmin, ray.direction.x, ray.direction.y, ray.direction.z, 0.0f,
      ray.tmax,     ~0u,          0u,           0u};
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return query;
}

bool read_hit(const RTCRayHit& query, const RayScene& scene, Hit& hit) {
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
  const float side =
      query.hit.Ng_x * query.ray.dir_x + query.hit.Ng_y * query.ray.dir_y + query.hit.Ng_z * query.ray.dir_z;
  // Barycentrics may leave the triangle by a rounding error; keep the contract of SurfacePoint.
  const float u = std::clamp(query.hit.u, 0.0f, 1.0f);
  hit = {query.ray.tfar,
         query.hit.geomID,
         query.hit.primID,
         u,
         std::clamp(query.hit.v, 0.0f, 1.0f - u),
         side * scene.instance(query.hit.geomID).handedness <= 0};
  return true;
}

// Random reads of textures and vertices miss the TLB on 4 KiB pages; huge pages took 5..20 % off a path. Only
// advice; without it (old kernels, other systems) all works, slower. Ranges are widened to whole huge pages: big
// arrays lie side by side, and what else is on the page is not harmed.
template <class T>
void advise_huge_pages(const std::vector<T>& array) {
#if defined(__linux__)
  constexpr std::uintptr_t kHuge = std::uintptr_t{2} << 20;
  constexpr int kCollapse = 25;  // MADV_COLLAPSE, Linux 6.1; not in older headers
  const std::size_t bytes = array.size() * sizeof(T);
  if (bytes < kHuge / 4) return;
  const auto first = reinterpret_cast<std::uintptr_t>(array.data());
  for (auto page = first & ~(kHuge - 1); page < first + bytes; page += kHuge) {
    void* at = reinterpret_cast<void*>(page);  // NOLINT(performance-no-int-to-ptr): a page, not an object
    ::madvise(at, kHuge, MADV_HUGEPAGE);
    ::madvise(at, kHuge, kCollapse);
  }
#endif
}

void advise_huge_pages_of(const scene::Scene& scene) {
  for (const auto& image : scene.images) advise_huge_pages(image.pixels);
  for (const auto& mesh : scene.meshes) {
    advise_huge_pages(mesh.normals);
    advise_huge_pages(mesh.tangents);
    advise_huge_pages(mesh.triangles);
    for (const auto& uvs : mesh.uvs) advise_huge_pages(uvs);
  }
}

Result<void> check_instance(const scene::Scene& scene, std::size_t index) {
  const auto& instance = scene.instances[index];
  const std::string name = "instance " + std::to_string(index);
  if (instance.mesh >= scene.meshes.size()) return fail(name + ": refers to a mesh that is not there");
  const auto& mesh = scene.meshes[instance.mesh];
  if (mesh.material >= scene.materials.size()) return fail(name + ": refers to a material that is not there");
  for (const auto& t : mesh.triangles)
    if (std::max({t.x, t.y, t.z}) >= mesh.positions.size())
      return fail(name + ": a triangle refers to a vertex that is not there");
  if (mesh.normals.size() != mesh.positions.size()) return fail(name + ": its mesh has not one normal per vertex");
  return {};
}

}  // namespace

RayScene::~RayScene() = default;

Result<std::shared_ptr<const RayScene>> RayScene::build(std::shared_ptr<const scene::Scene> scene, unsigned threads,
                                                        Filters filters) {
  std::shared_ptr<RayScene> made(new RayScene);
  made->scene_ = scene;
  made->device_ = std::make_unique<Device>();
  const std::string config = "threads=" + std::to_string(std::max(threads, 1u)) + ",set_affinity=0";
  made->device_->device = rtcNewDevice(config.c_str());
  if (made->device_->device == nullptr) return fail("ray library: no device could be made");
  made->device_->scene = rtcNewScene(made->device_->device);
  auto* target = made->device_->scene;
  rtcSetSceneBuildQuality(target, RTC_BUILD_QUALITY_HIGH);
  rtcSetSceneFlags(target, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));

  made->world_positions_.resize(scene->instances.size());
  made->instances_.resize(scene->instances.size());
  for (std::size_t i = 0; i < scene->instances.size(); ++i) {
    if (auto ok = check_instance(*scene, i); !ok) return std::unexpected(ok.error());
    const auto& instance = scene->instances[i];
    const auto& mesh = scene->meshes[instance.mesh];
    auto& world = made->world_positions_[i];
    world.reserve(mesh.positions.size() + 1);
    for (const auto& p : mesh.positions) world.emplace_back(instance.to_world * glm::vec4(p, 1.0f));
    world.emplace_back(0.0f);
    advise_huge_pages(world);
    auto& placed = made->instances_[i];
    placed.mesh = &mesh;
    placed.material = &scene->materials[mesh.material];
    placed.positions = world.data();
    placed.tangent_to_world = glm::mat3(instance.to_world);
    const float determinant = glm::determinant(placed.tangent_to_world);
    placed.normal_to_world =
        std::abs(determinant) > 0 ? glm::transpose(glm::inverse(placed.tangent_to_world)) : glm::mat3(1.0f);
    placed.handedness = instance.flipped ? -1.0f : 1.0f;
    placed.textures = scene::texture_set(*scene, *placed.material);
    if (mesh.triangles.empty()) continue;

    RTCGeometry geometry = rtcNewGeometry(made->device_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, world.data(), 0,
                               sizeof(glm::vec3), mesh.positions.size());
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                               sizeof(glm::uvec3), mesh.triangles.size());
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    const bool masked = placed.material->alpha_mode == scene::AlphaMode::kMask;
    made->has_masks_ = made->has_masks_ || masked;
    if (masked || filters == Filters::kEverywhere) {
      rtcSetGeometryUserData(geometry, made.get());
      rtcSetGeometryIntersectFilterFunction(geometry, pass_masked);
      rtcSetGeometryOccludedFilterFunction(geometry, pass_masked);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(target, geometry, static_cast<unsigned>(i));
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(target);
  advise_huge_pages_of(*scene);
  if (const auto error = rtcGetDeviceError(made->device_->device); error != RTC_ERROR_NONE)
    return fail("ray library: build failed with code " + std::to_string(error) +
                (error == RTC_ERROR_OUT_OF_MEMORY ? " (out of memory; use a smaller scene)" : ""));
  return made;
}

bool RayScene::closest(const Ray& ray, Hit& hit) const {
  if (!is_traceable(ray)) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query = to_embree(ray);
  rtcIntersect1(device_->scene, &context, &query);
  return read_hit(query, *this, hit);
}

bool RayScene::closest_camera(const Ray& ray, Hit& hit) const {
  if (!is_traceable(ray)) return false;
  CameraContext context{};
  rtcInitIntersectContext(&context.base);
  context.base.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  context.base.filter = pass_single_sided_backs;
  context.scene = this;
  RTCRayHit query = to_embree(ray);
  rtcIntersect1(device_->scene, &context.base, &query);
  return read_hit(query, *this, hit);
}

bool RayScene::occluded(const Ray& ray) const {
  if (!is_traceable(ray)) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay query = to_embree(ray).ray;
  rtcOccluded1(device_->scene, &context, &query);
  return query.tfar < 0;
}

DenormalsAreZero::DenormalsAreZero() {
#if defined(__SSE2__)
  saved_ = _mm_getcsr();
  _mm_setcsr(saved_ | 0x8040u);
#endif
}

DenormalsAreZero::~DenormalsAreZero() {
#if defined(__SSE2__)
  _mm_setcsr(saved_);
#endif
}

}  // namespace darm::renderer::trace
