// links: darm_renderer embree
// Speed of the tracer on a real scene, beside its limits: rays against a bare Embree loop over the same rays, paths
// against Blender Cycles 3.4 (0.33 M paths/s on Sponza, 640x360, 32 bounces, two threads).
// Usage: tracer_bench [SCENE.glb] [THREADS] [SPP]
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "actors/renderer/exposure.hpp"
#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/reference_renderer.hpp"
#include "actors/renderer/sampling.hpp"
#include "actors/scene/gltf_loader.hpp"
#include "tests/bench/bare_scene.hpp"

namespace {

using namespace darm;
using namespace darm::renderer;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

// One bounce off what a camera sees: the incoherent rays that path tracing is made of.
std::vector<trace::Ray> bounce_rays(const trace::RayScene& rays, const glm::vec3& eye, std::uint32_t count) {
  std::vector<trace::Ray> made;
  for (std::uint32_t i = 0; made.size() < count && i < count * 8; ++i) {
    Sampler sampler(1, i, 0);
    const glm::vec2 a = sampler.next_2d();
    const float z = 1 - 2 * a.x, r = std::sqrt(std::max(0.0f, 1 - z * z));
    trace::Hit hit;
    if (!rays.closest_camera({eye, 0, {r * std::cos(6.2831853f * a.y), z, r * std::sin(6.2831853f * a.y)}, 1e30f}, hit))
      continue;
    const auto s = trace::make_surface(rays, hit);
    glm::vec3 t, b;
    trace::make_frame(s.normal, t, b);
    const glm::vec3 d = sample_cosine(sampler.next_2d());
    const glm::vec3 w = glm::normalize(t * d.x + b * d.y + s.normal * d.z);
    made.push_back({trace::spawn_origin(s, w), 0, w, 1e30f});
  }
  return made;
}

double bare_rays_per_second(const trace::RayScene& rays, const std::vector<trace::Ray>& queries) {
  const bench::BareScene bare(rays);
  const auto start = Clock::now();
  unsigned hits = 0;
  for (const auto& r : queries) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit q;
    q.ray = {r.origin.x, r.origin.y, r.origin.z, r.tmin, r.direction.x, r.direction.y, r.direction.z, 0,
             r.tmax,     ~0u,        0u,         0u};
    q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    q.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(bare.scene(), &context, &q);
    hits += q.hit.geomID != RTC_INVALID_GEOMETRY_ID ? 1u : 0u;
  }
  const double seconds = seconds_since(start);
  return hits > 0 ? static_cast<double>(queries.size()) / seconds : 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string path = argc > 1 ? argv[1] : std::string(DARM_SHARED_SCENES) + "/scenes/sponza.glb";
  const unsigned threads = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 2;
  const unsigned spp = argc > 3 ? static_cast<unsigned>(std::atoi(argv[3])) : 8;
  scene::LightSetup setup;
  if (path.find("sponza") != std::string::npos || path.find("quake") != std::string::npos) {
    setup.sky = scene::Sky{glm::vec3(4000), glm::vec3(4000), glm::vec3(4000)};
    if (path.find("sponza") != std::string::npos) setup.sun = scene::Sun{{0.3f, -1, 0.15f}, glm::vec3(1e5f), 0.53f};
  }
  auto start = Clock::now();
  auto scene = scene::load_scene(path, setup);
  if (!scene) return std::fprintf(stderr, "%s\n", scene.error().message.c_str()), 1;
  const double load = seconds_since(start);
  start = Clock::now();
  auto rays = trace::RayScene::build(*scene, threads);
  if (!rays) return std::fprintf(stderr, "%s\n", rays.error().message.c_str()), 1;
  std::printf("load %.2f s, build %.2f s, %llu triangles\n", load, seconds_since(start),
              static_cast<unsigned long long>((*scene)->triangle_count()));

  Camera camera = look_at({-10, 1.5, -0.3}, {10, 4, 0}, 60);
  if (path.find("sponza") == std::string::npos && !(*scene)->cameras.empty()) camera = (*scene)->cameras[0].camera;
  const trace::DenormalsAreZero denormals;
  const auto queries = bounce_rays(**rays, glm::vec3(camera.position - (*scene)->origin), 1'000'000);
  double ours = 0, bare = 0, shadow = 0;
  for (int round = 0; round < 3; ++round) {
    bare = std::max(bare, bare_rays_per_second(**rays, queries));
    start = Clock::now();
    unsigned hits = 0;
    trace::Hit hit;
    for (const auto& q : queries) hits += (*rays)->closest(q, hit) ? 1u : 0u;
    ours = std::max(ours, static_cast<double>(queries.size()) / seconds_since(start));
    start = Clock::now();
    for (const auto& q : queries) hits += (*rays)->occluded(q) ? 1u : 0u;
    shadow = std::max(shadow, static_cast<double>(queries.size()) / seconds_since(start));
    if (hits == 0) std::puts("no ray hit anything");
  }
  std::printf("closest %.2f M rays/s, bare Embree %.2f M rays/s, ratio %.3f; occluded %.2f M rays/s (one thread)\n",
              ours / 1e6, bare / 1e6, ours / bare, shadow / 1e6);

  renderer::TransportOptions options;
  options.max_bounces = 32;  // as Cycles was run
  const LightTransport transport(*scene, *rays, options);
  start = Clock::now();
  const float exposure = scene_exposure(transport);
  std::printf("exposure %g in %.2f s\n", static_cast<double>(exposure), seconds_since(start));
  for (const auto effects : {PictureEffects::kFull, PictureEffects::kViewIndependent}) {
    ReferenceJob job;
    job.camera = camera;
    job.viewport = {640, 360};
    job.exposure = exposure;
    job.effects = effects;
    job.spp = spp;
    job.threads = threads;
    const std::clock_t cpu = std::clock();
    const auto picture = render_reference(transport, job);
    const double cpu_seconds = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
    if (!picture) return std::fprintf(stderr, "%s\n", picture.error().message.c_str()), 1;
    const bool full = effects == PictureEffects::kFull;
    std::printf(
        "%s: %.3f M paths/s on %u threads, %.3f M per CPU second (Cycles 3.4 on Sponza: 0.33), own PSNR %.1f dB at %u "
        "spp\n",
        full ? "full" : "view-independent", static_cast<double>(picture->paths) / picture->seconds / 1e6, threads,
        static_cast<double>(picture->paths) / cpu_seconds / 1e6, picture->own_psnr, picture->spp);
    if (const char* out = std::getenv("TRACER_BENCH_PNG")) {
      if (auto ok = write_png(std::string(out) + (full ? ".full.png" : ".vi.png"), picture->mean); !ok)
        std::fprintf(stderr, "%s\n", ok.error().message.c_str());
    }
  }
  return 0;
}
