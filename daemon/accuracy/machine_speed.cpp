#include "daemon/accuracy/machine_speed.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <thread>
#include <vector>

namespace darm::accuracy {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Viewport kPicture{1024, 1024};
constexpr std::uint64_t kBetweenLooks = 256;  // rays; looking at the clock must not count

float fraction(double x) { return static_cast<float>(x - std::floor(x)); }

}  // namespace

double rays_per_second(const renderer::trace::RayScene& rays, const Camera& camera, unsigned threads, double seconds) {
  const glm::vec3 eye(camera.position - rays.scene().origin);
  std::atomic<std::uint64_t> traced{0};
  const auto start = Clock::now();
  const auto passed = [start] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  const auto work = [&](std::uint64_t first) {
    const renderer::trace::DenormalsAreZero denormals;
    std::uint64_t done = 0;
    for (; done % kBetweenLooks != 0 || passed() < seconds; ++done) {
      const auto i = static_cast<double>(first + done);  // evenly over the picture, near ones far apart in time
      renderer::trace::Ray ray;
      ray.origin = eye;
      ray.direction = ray_direction(camera, kPicture, fraction(i * 0.7548776662466927) * float{kPicture.width},
                                    fraction(i * 0.5698402909980532) * float{kPicture.height});
      renderer::trace::Hit hit;
      (void)rays.closest(ray, hit);
    }
    traced += done;
  };
  {
    std::vector<std::jthread> others;
    for (unsigned t = 1; t < std::max(threads, 1u); ++t) others.emplace_back(work, std::uint64_t{t} << 20);
    work(0);
  }
  return static_cast<double>(traced) / std::max(passed(), 1e-9);
}

}  // namespace darm::accuracy
