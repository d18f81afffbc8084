#include "actors/renderer/light_set.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "actors/renderer/material_point.hpp"
#include "actors/renderer/sampler.hpp"
#include "actors/renderer/trace/surface.hpp"

namespace darm::renderer {
namespace {

constexpr float kNearest = 1e-4f;         // a point light is no nearer than 0.1 mm: its irradiance stays finite
constexpr float kNearestOfScene = 1e-5f;  // nor than this share of the scene where that is less: models may be small
constexpr float kCosineFloor = 0.05f;     // keeps lights reachable that only a bent normal or a glossy lobe sees
constexpr float kSmallestDisc = 1e-5f;    // radians; below, a sun is a delta light

// Square root within 4 %: drawing a light needs a weight, not an exact one, and integers vectorise.
float rough_sqrt(float x) { return std::bit_cast<float>((std::bit_cast<std::int32_t>(x) >> 1) + 0x1fbd1df5); }

SunLight make_sun(const scene::Light& light) {
  SunLight sun;
  sun.towards = -glm::normalize(light.direction);
  trace::make_frame(sun.towards, sun.tangent, sun.bitangent);
  sun.irradiance = light.intensity;
  if (light.angular_diameter > kSmallestDisc) {
    const float radius = 0.5f * std::min(light.angular_diameter, 3.0f);
    const float half_chord = 2.0f * std::sin(0.5f * radius);
    sun.chord2 = half_chord * half_chord;
    sun.radiance = light.intensity / (kPi * std::sin(radius) * std::sin(radius));
  }
  return sun;
}

}  // namespace

LightSet::LightSet(const trace::RayScene& rays) : rays_(rays) {
  const float extent = glm::length(rays.scene().bounds_max - rays.scene().bounds_min);
  const float nearest = extent > 0 ? std::min(kNearest, kNearestOfScene * extent) : kNearest;
  nearest_square_ = std::max(nearest * nearest, std::numeric_limits<float>::min());
  std::vector<double> powers;
  for (const auto& light : rays.scene().lights) {
    const float power = luminance(light.intensity);
    if (!(power > 0) || !std::isfinite(power)) continue;
    if (light.kind == scene::LightKind::kDirectional) {
      suns_.push_back(make_sun(light));
      continue;
    }
    Punctual p;
    p.position = light.position;
    p.intensity = light.intensity;
    p.direction = glm::normalize(light.direction);
    if (light.range > 0) p.inverse_range2 = 1.0f / (light.range * light.range);
    if (light.kind == scene::LightKind::kSpot) {
      p.spot_scale = 1.0f / std::max(1e-3f, light.cos_inner - light.cos_outer);
      p.spot_offset = -light.cos_outer * p.spot_scale;
    }
    punctual_.push_back(p);
    punctual_x_.push_back(p.position.x);
    punctual_y_.push_back(p.position.y);
    punctual_z_.push_back(p.position.z);
    punctual_power_.push_back(power);
    powers.push_back(power);
  }
  punctual_table_ = AliasTable(powers);

  std::vector<double> emitted;
  emitter_pdf_.resize(rays.instance_count());
  for (std::uint32_t i = 0; i < rays.instance_count(); ++i) add_emitters(rays, i, emitted);
  emitter_table_ = AliasTable(emitted);
  if (emitter_table_.empty()) {
    emitters_.clear();
    for (auto& pdfs : emitter_pdf_) pdfs.clear();
  }
  for (std::size_t i = 0; i < emitters_.size(); ++i)
    emitter_pdf_[emitters_[i].instance][emitters_[i].triangle] =
        emitter_table_.probability(i) * emitters_[i].inverse_area;
}

void LightSet::add_emitters(const trace::RayScene& rays, std::uint32_t instance, std::vector<double>& power) {
  const auto& placed = rays.instance(instance);
  // Unlit surfaces shine too, but dimly and everywhere: paths find them. Here are only the lamps.
  if (!placed.material->emits() || placed.material->unlit) return;
  const auto& mesh = *placed.mesh;
  emitter_pdf_[instance].assign(mesh.triangles.size(), 0.0f);
  const float sides = placed.material->double_sided ? 2.0f : 1.0f;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto s = trace::make_surface(rays, SurfacePoint{instance, t, 1.0f / 3, 1.0f / 3, true});
    if (!(s.area > 0) || !std::isfinite(s.area)) continue;
    float mean = luminance(placed.material->emissive);
    if (placed.material->emissive_texture.present()) {
      // Sixteen texels, and a floor for what they miss; a dark triangle needs no draws, paths find what is left of it.
      float sum = 0;
      for (std::uint32_t k = 0; k < 16; ++k) {
        const glm::vec2 b =
            sample_triangle({(static_cast<float>(k) + 0.5f) / 16.0f, detail::to_unit(detail::reverse_bits(k))});
        sum += luminance(emitted_radiance(rays.scene(), placed, t, b.x, b.y));
      }
      mean = sum / 16.0f + 0.002f * mean;
    }
    const double p = static_cast<double>(mean) * s.area * sides;
    if (!(p > 0) || !std::isfinite(p)) continue;
    emitters_.push_back({instance, t, 1.0f / s.area});
    power.push_back(p);
  }
}

glm::vec3 LightSet::arriving(const Punctual& light, const glm::vec3& position) const {
  const glm::vec3 to = light.position - position;
  const float square = std::max(glm::dot(to, to), nearest_square_);
  float factor = 1.0f / square;
  if (light.inverse_range2 > 0) {
    const float r2 = square * light.inverse_range2;
    factor *= std::clamp(1.0f - r2 * r2, 0.0f, 1.0f);  // KHR_lights_punctual, range
  }
  const float cosine = -glm::dot(light.direction, to) / std::sqrt(square);
  const float spot = std::clamp(cosine * light.spot_scale + light.spot_offset, 0.0f, 1.0f);
  return light.intensity * (factor * spot * spot);
}

float LightSet::weigh_punctual(const glm::vec3& position, const glm::vec3& normal, bool both_sides,
                               std::span<float> weight) const {
  const float behind = both_sides ? 1.0f : 0.0f;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    const float x = punctual_x_[i] - position.x;
    const float y = punctual_y_[i] - position.y;
    const float z = punctual_z_[i] - position.z;
    const float square = x * x + y * y + z * z + nearest_square_;
    const float length = rough_sqrt(square);
    const float along = x * normal.x + y * normal.y + z * normal.z;
    const float cosine = (along > 0 ? along : -along * behind) + kCosineFloor * length;
    weight[i] = punctual_power_[i] * cosine / (square * length);
  }
  float sum = 0;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    // A light that cannot reach this point by its cone or range needs no draw.
    if (punctual_[i].spot_scale > 0 || punctual_[i].inverse_range2 > 0) {
      const glm::vec3 a = arriving(punctual_[i], position);
      if (!(a.x + a.y + a.z > 0)) weight[i] = 0;
    }
    sum += weight[i];
  }
  return sum;
}

std::size_t LightSet::draw_punctual(const glm::vec3& position, const glm::vec3& normal, bool both_sides, float xi,
                                    std::span<PunctualDraw> out) const {
  const std::size_t n = punctual_.size();
  if (n > kAllLights) {
    const auto i = punctual_table_.draw(xi);
    const float p = punctual_table_.probability(i);
    if (!(p > 0)) return 0;
    out[0] = {punctual_[i].position, arriving(punctual_[i], position) / p};
    return 1;
  }
  std::array<float, kAllLights> weights;
  const std::span<float> weight(weights.data(), n);
  const float sum = weigh_punctual(position, normal, both_sides, weight);
  if (!(sum > 0) || !std::isfinite(sum)) return 0;
  // Systematic sampling: picks at (k + xi) / out.size() of the summed weights. A light that several picks meet is
  // returned once, with their number as weight.
  const float step = sum / static_cast<float>(out.size());
  float next_pick = xi * step;
  float reached = 0;
  std::size_t picks = 0;
  std::size_t made = 0;
  for (std::size_t i = 0; i < n && picks < out.size(); ++i) {
    reached += weight[i];
    std::size_t mine = 0;
    for (; picks < out.size() && next_pick < reached; ++picks, ++mine) next_pick += step;
    if (mine == 0) continue;
    out[made++] = {punctual_[i].position,
                   arriving(punctual_[i], position) * (step * static_cast<float>(mine) / weight[i])};
  }
  return made;
}

EmitterDraw LightSet::draw_emitter(float xi, const glm::vec2& point) const {
  EmitterDraw made;
  const auto i = emitter_table_.draw(xi);
  const float probability = emitter_table_.probability(i);
  if (!(probability > 0)) return made;
  const Emitter& e = emitters_[i];
  const auto& placed = rays_.instance(e.instance);
  const glm::uvec3 corner = placed.mesh->triangles[e.triangle];
  const glm::vec3 a = placed.positions[corner.x];
  const glm::vec3 ab = placed.positions[corner.y] - a;
  const glm::vec3 ac = placed.positions[corner.z] - a;
  const glm::vec2 b = sample_triangle(point);
  made.position = a + ab * b.x + ac * b.y;
  made.normal = glm::normalize(glm::cross(ab, ac)) * placed.handedness;
  made.radiance = emitted_radiance(rays_.scene(), placed, e.triangle, b.x, b.y);
  made.double_sided = placed.material->double_sided;
  made.pdf_area = probability * e.inverse_area;
  return made;
}

float LightSet::emitter_pdf(std::uint32_t instance, std::uint32_t triangle) const {
  const auto& pdfs = emitter_pdf_[instance];
  return pdfs.empty() ? 0.0f : pdfs[triangle];
}

}  // namespace darm::renderer
