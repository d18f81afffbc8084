#include "actors/tile_scheduler/view_sampler.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace darm::tile_scheduler {

Footprint footprint_of(glm::vec2 uv_dx, glm::vec2 uv_dy) {
  // Singular values of a 2x2 matrix from its Frobenius norm and determinant; the minor one as |det| / major, which
  // keeps its digits where the difference of the quadratic's terms would cancel.
  const double sum = double(glm::dot(uv_dx, uv_dx)) + double(glm::dot(uv_dy, uv_dy));
  const double det = double(uv_dx.x) * uv_dy.y - double(uv_dx.y) * uv_dy.x;
  if (!std::isfinite(sum) || !std::isfinite(det) || sum <= 0) return {};
  const double major = std::sqrt(0.5 * (sum + std::sqrt(std::max(0.0, sum * sum - 4 * det * det))));
  const double minor = std::abs(det) / major;  // major > 0: sum > 0
  return {static_cast<float>(minor), static_cast<float>(std::min(major, minor * kMaxAnisotropy))};
}

int sharp_level(float minor_texels, int coarse_level) {
  if (!(minor_texels > 1e-6f)) return 0;  // also NaN
  const float exact = std::floor(std::log2(std::min(minor_texels, 1e9f)));
  return std::clamp(static_cast<int>(exact), 0, coarse_level);
}

ViewSampler::ViewSampler(const atlas::Layout& layout, const renderer::trace::RayScene& rays, const Camera& camera,
                         const Viewport& viewport)
    : layout_(layout), rays_(rays), viewport_(viewport), origin_(camera.position - rays.scene().origin) {
  const float half_height = std::tan(camera.fovy * 0.5f);
  const auto width = static_cast<float>(viewport.width);
  const auto height = static_cast<float>(viewport.height);
  const float pixel = 2.0f * half_height / height;
  right_ = camera.orientation * glm::vec3(pixel, 0, 0);
  down_ = camera.orientation * glm::vec3(0, -pixel, 0);
  corner_ = camera.orientation * glm::vec3(-0.5f * width * pixel, half_height, -1.0f);
  const glm::vec3 extent = glm::max(glm::abs(rays.scene().bounds_min), glm::abs(rays.scene().bounds_max));
  past_ = 1e-6f * std::max({extent.x, extent.y, extent.z, glm::length(origin_)});
}

int ViewSampler::trace(float x, float y, std::array<SurfaceSample, kMaxLayers>& out) const {
  const glm::vec3 direction = corner_ + right_ * x + down_ * y;
  renderer::trace::Ray ray;
  ray.origin = origin_;
  ray.direction = glm::normalize(direction);
  ray.tmin = 0;
  int count = 0;
  for (int layer = 0; layer < kMaxLayers; ++layer) {
    renderer::trace::Hit hit{};
    if (!rays_.closest_camera(ray, hit)) break;
    const bool has_texels = surface_of(hit, direction, out[static_cast<std::size_t>(count)]);
    if (has_texels) ++count;
    const auto& material = *rays_.instance(hit.instance).material;
    const bool seen_through = material.alpha_mode == scene::AlphaMode::kBlend || material.transmission > 0;
    if (!seen_through && has_texels) break;
    ray.tmin = hit.t * (1.0f + 1e-5f) + past_;  // past this surface, whatever the scale of the scene
  }
  return count;
}

bool ViewSampler::surface_of(const renderer::trace::Hit& hit, const glm::vec3& direction, SurfaceSample& out) const {
  out.patch = layout_.patch_of(hit.instance, hit.triangle, hit.front);
  if (out.patch == kNoPatch) return false;
  out.instance = hit.instance;
  out.uv = layout_.patch_uv(hit.instance, hit.triangle, hit.u, hit.v);
  const auto& chart = layout_.charts[layout_.instances[hit.instance].chart];
  out.patch_size = chart.patch_size[chart.local_patch[hit.triangle]];

  const auto& instance = rays_.instance(hit.instance);
  const auto corners = instance.mesh->triangles[hit.triangle];
  const glm::vec3 e1 = instance.positions[corners.y] - instance.positions[corners.x];
  const glm::vec3 e2 = instance.positions[corners.z] - instance.positions[corners.x];
  const glm::vec3 n = glm::cross(e1, e2);
  const float nn = glm::dot(n, n);
  const float facing = glm::dot(direction, n);
  // The point seen is origin + t * direction with t = const / dot(direction, n), and direction is linear in x and y:
  // its derivative is the limit of the neighbour pixels' rays against the triangle's plane, without their horizon.
  const float t = hit.t / glm::length(direction);
  const auto gradient = [&](const glm::vec3& step) {
    const glm::vec3 moved = t * (step - direction * (glm::dot(step, n) / facing));
    const float a = glm::dot(glm::cross(moved, e2), n) / nn;
    const float b = glm::dot(glm::cross(e1, moved), n) / nn;
    const auto& c = chart.uv[hit.triangle];
    return (c[1] - c[0]) * a + (c[2] - c[0]) * b;
  };
  const float lengths = std::sqrt(nn) * glm::length(direction);
  const float cosine = std::abs(facing) / lengths;
  out.cosine = cosine < 1 ? cosine : 1.0f;  // 1 also where there is no normal, or one too long for a float
  if (std::abs(facing) > 1e-30f && nn > 0) {
    out.uv_dx = gradient(right_);
    out.uv_dy = gradient(down_);
  } else {
    out.uv_dx = out.uv_dy = glm::vec2(0.0f);
  }
  const auto footprint = footprint_of(out.uv_dx, out.uv_dy);
  out.pixel_texels = footprint.minor * layout_.q;
  out.level = sharp_level(out.pixel_texels, layout_.coarse_level());
  return true;
}

}  // namespace darm::tile_scheduler
