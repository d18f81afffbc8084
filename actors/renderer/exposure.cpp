#include "actors/renderer/exposure.hpp"

#include <algorithm>
#include <cmath>

#include "actors/renderer/sampler.hpp"
#include "actors/renderer/sampling.hpp"
#include "actors/renderer/trace/surface.hpp"

namespace darm::renderer {
namespace {

constexpr std::uint32_t kSamplesPerPoint = 8;
constexpr std::uint64_t kSeed = 0x6578706f73757265;
// Where light is in rare samples most points see none: the mean root of such is near 0, whatever the light. Then more
// samples are taken, and those of points that lie together are one.
constexpr std::uint32_t kSamplesOfRare = 64;
constexpr std::uint32_t kPointsTogether = 32;
// Lesser over greater half of a point's samples, mean: usual scenes have .5 to .9, rooms lit over a spot .25.
constexpr double kRare = 0.35;

struct Point {
  std::uint32_t instance = 0;
  std::uint32_t triangle = 0;
  std::uint32_t number = 0;
};

double triangle_area(const trace::WorldInstance& placed, const glm::uvec3& t) {
  const glm::vec3 a = placed.positions[t.x];
  return 0.5 * static_cast<double>(glm::length(glm::cross(placed.positions[t.y] - a, placed.positions[t.z] - a)));
}

double mean_luminance(const LightTransport& transport, const Point& at, std::uint32_t first, std::uint32_t samples) {
  double sum = 0;
  for (std::uint32_t i = first; i < first + samples; ++i) {
    Sampler sampler(kSeed, at.number, i);
    const glm::vec2 b = sample_triangle(sampler.next_2d());
    sum +=
        static_cast<double>(luminance(transport.irradiance({at.instance, at.triangle, b.x, b.y, true}, sampler).sum()));
  }
  return sum / samples;
}

// Systematic sampling: one point per equal share of the area, in one sweep over the triangles, nothing stored.
template <class Visit>
void each_point(const trace::RayScene& rays, double total, std::uint32_t points, Visit visit) {
  const double step = total / points;
  double next = 0.5 * step;
  double passed = 0;
  Point at;
  for (at.instance = 0; at.instance < rays.instance_count(); ++at.instance) {
    const auto& triangles = rays.instance(at.instance).mesh->triangles;
    for (at.triangle = 0; at.triangle < triangles.size(); ++at.triangle) {
      passed += triangle_area(rays.instance(at.instance), triangles[at.triangle]);
      for (; next < passed && at.number < points; next += step) {
        visit(at);
        ++at.number;
      }
    }
  }
}

// Of irradiance, over groups of points.
double mean_root_of_rare(const LightTransport& transport, double total, std::uint32_t points) {
  double roots = 0, group = 0;
  std::uint32_t taken = 0;
  const auto close_group = [&](std::uint32_t of) {
    roots += of * std::sqrt(group / of);
    group = 0;
  };
  each_point(transport.rays(), total, points, [&](const Point& at) {
    group += mean_luminance(transport, at, 0, kSamplesOfRare);
    if (++taken % kPointsTogether == 0) close_group(kPointsTogether);
  });
  if (taken % kPointsTogether != 0) close_group(taken % kPointsTogether);
  return taken > 0 ? roots / taken : 0;
}

}  // namespace

float scene_exposure(const LightTransport& transport, std::uint32_t points) {
  const trace::DenormalsAreZero denormals;
  const auto& rays = transport.rays();
  double total = 0;
  for (std::uint32_t i = 0; i < rays.instance_count(); ++i)
    for (const auto& t : rays.instance(i).mesh->triangles) total += triangle_area(rays.instance(i), t);
  if (!(total > 0) || !std::isfinite(total) || points == 0) return 1.0f;

  double roots = 0, alike = 0, lit = 0;
  std::uint32_t taken = 0;
  each_point(rays, total, points, [&](const Point& at) {
    constexpr std::uint32_t kHalf = kSamplesPerPoint / 2;
    const double one = mean_luminance(transport, at, 0, kHalf), other = mean_luminance(transport, at, kHalf, kHalf);
    roots += std::sqrt((one + other) / 2);
    if (const double more = std::max(one, other); more > 0) {
      alike += std::min(one, other) / more;
      ++lit;
    }
    ++taken;
  });
  double mean_root = taken > 0 ? roots / taken : 0;
  if (alike < kRare * lit) mean_root = mean_root_of_rare(transport, total, points);
  const double irradiance = mean_root * mean_root;
  if (!(irradiance > 1e-12) || !std::isfinite(irradiance)) return 1.0f;
  return static_cast<float>(static_cast<double>(kPi) / irradiance);
}

}  // namespace darm::renderer
