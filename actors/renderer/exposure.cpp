#include "actors/renderer/exposure.hpp"

#include <cmath>

#include "actors/renderer/sampler.hpp"
#include "actors/renderer/sampling.hpp"
#include "actors/renderer/trace/surface.hpp"

namespace darm::renderer {
namespace {

constexpr std::uint32_t kSamplesPerPoint = 8;
constexpr std::uint64_t kSeed = 0x6578706f73757265;

double triangle_area(const trace::WorldInstance& placed, const glm::uvec3& t) {
  const glm::vec3 a = placed.positions[t.x];
  return 0.5 * static_cast<double>(glm::length(glm::cross(placed.positions[t.y] - a, placed.positions[t.z] - a)));
}

double mean_luminance(const LightTransport& transport, std::uint32_t instance, std::uint32_t triangle,
                      std::uint32_t number) {
  double sum = 0;
  for (std::uint32_t i = 0; i < kSamplesPerPoint; ++i) {
    Sampler sampler(kSeed, number, i);
    const glm::vec2 b = sample_triangle(sampler.next_2d());
    sum += static_cast<double>(luminance(transport.irradiance({instance, triangle, b.x, b.y, true}, sampler).sum()));
  }
  return sum / kSamplesPerPoint;
}

}  // namespace

float scene_exposure(const LightTransport& transport, std::uint32_t points) {
  const trace::DenormalsAreZero denormals;
  const auto& rays = transport.rays();
  double total = 0;
  for (std::uint32_t i = 0; i < rays.instance_count(); ++i)
    for (const auto& t : rays.instance(i).mesh->triangles) total += triangle_area(rays.instance(i), t);
  if (!(total > 0) || !std::isfinite(total) || points == 0) return 1.0f;

  // Systematic sampling: one point per equal share of the area, in one sweep over the triangles, nothing stored.
  const double step = total / points;
  double next = 0.5 * step;
  double passed = 0;
  double roots = 0;
  std::uint32_t taken = 0;
  for (std::uint32_t i = 0; i < rays.instance_count(); ++i) {
    const auto& triangles = rays.instance(i).mesh->triangles;
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      passed += triangle_area(rays.instance(i), triangles[t]);
      for (; next < passed && taken < points; next += step)
        roots += std::sqrt(mean_luminance(transport, i, t, taken++));
    }
  }
  const double mean_root = taken > 0 ? roots / taken : 0;
  const double irradiance = mean_root * mean_root;
  if (!(irradiance > 1e-12) || !std::isfinite(irradiance)) return 1.0f;
  return static_cast<float>(static_cast<double>(kPi) / irradiance);
}

}  // namespace darm::renderer
