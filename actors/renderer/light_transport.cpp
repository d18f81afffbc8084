#include "actors/renderer/light_transport.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <span>

#include "actors/renderer/bsdf.hpp"
#include "actors/renderer/sampling.hpp"
#include "actors/scene/texture_sampling.hpp"

namespace darm::renderer {
namespace {

constexpr int kMostLayers = 256;           // surfaces one straight ray may pass through
constexpr float kShortOfTarget = 0.9999f;  // shadow rays end before the lamp they aim at
constexpr std::size_t kSunsEach = 4;       // up to so many suns get a shadow ray each; of more, one is drawn
constexpr std::size_t kMostPicks = 4;      // lamps drawn at the first vertex, where their noise is seen directly

float largest(const glm::vec3& v) { return std::max({v.x, v.y, v.z}); }

glm::vec3 finite_or_black(const glm::vec3& v) {
  return std::isfinite(v.x + v.y + v.z) ? glm::max(v, glm::vec3(0.0f)) : glm::vec3(0.0f);
}

// The first vertex of view-independent light: white Lambert about the bent normal, cut off at the surface. Albedo comes
// in at the end, so that a sample's path does not depend on it.
struct DiffuseScatter {
  static constexpr bool kSunByDirection = false;  // its suns come from shadow rays alone
  const trace::Surface& surface;

  [[nodiscard]] glm::vec3 evaluate(const glm::vec3& wi, float& pdf) const {
    const float cosine = glm::dot(surface.normal, wi);
    pdf = 0;
    if (cosine <= 0 || glm::dot(surface.geometric_normal, wi) <= 0) return glm::vec3(0.0f);
    pdf = cosine * kInversePi;
    return glm::vec3(pdf);
  }
  [[nodiscard]] const glm::vec3& normal() const { return surface.normal; }
  [[nodiscard]] bool transmits() const { return false; }
};

struct BsdfScatter : Bsdf {
  static constexpr bool kSunByDirection = true;
  using Bsdf::Bsdf;
};

}  // namespace

/// A ray on its way, and what the strategies need to know about where it comes from.
struct LightTransport::Path {
  trace::Ray ray;
  glm::vec3 throughput{1.0f};
  glm::vec3 from{0.0f};  // last scattering vertex
  float pdf = 0;         // of the direction, per steradian; 0: no other strategy could have made it
  std::uint32_t bounce = 0;
  bool camera = false;     // sees through the backs of single-sided triangles
  bool suns_done = false;  // the vertex before took its suns by shadow rays alone
  const StoredLight* stored = nullptr;
  bool sharp_seen = false;  // what it meets is seen in a mirror: sharp light is taken there, not from coarse texels
};

LightTransport::LightTransport(std::shared_ptr<const scene::Scene> scene, std::shared_ptr<const trace::RayScene> rays,
                               TransportOptions options)
    : scene_(std::move(scene)), rays_(std::move(rays)), options_(options), lights_(*rays_) {
  for (const auto& m : scene_->materials)
    any_passing_ = any_passing_ || may_pass(m) || (m.transmission > 0 && std::abs(m.ior - 1.0f) <= 1e-4f);
  has_sky_ = scene_->sky.emits();
}

bool LightTransport::sees_black(const scene::Material& m, bool front) {
  return !front && !m.double_sided && !(m.thickness > 0 && m.transmission > 0);
}

// Share of light that reaches `s` along `direction` (not unit: up to `target`, if given).
glm::vec3 LightTransport::visibility(const trace::Surface& s, const glm::vec3& direction,
                                     const glm::vec3* target) const {
  trace::Ray ray;
  ray.origin = trace::spawn_origin(s, direction);
  ray.direction = target != nullptr ? *target - ray.origin : direction;
  if (target != nullptr) ray.tmax = kShortOfTarget;
  if (!any_passing_) return glm::vec3(rays_->occluded(ray) ? 0.0f : 1.0f);
  glm::vec3 share(1.0f);
  const glm::vec3 unit = glm::normalize(ray.direction);
  trace::Hit hit;
  for (int layer = 0; layer < kMostLayers; ++layer) {
    if (!rays_->closest(ray, hit)) return share;
    if (!may_pass(*rays_->instance(hit.instance).material)) return glm::vec3(0.0f);
    const auto passed = trace::make_surface(*rays_, hit);
    const auto material = make_material_point(*scene_, passed);
    share *= material.straight_through(std::abs(glm::dot(passed.normal, unit)));
    if (largest(share) <= 0) return glm::vec3(0.0f);
    ray.origin = trace::spawn_origin(passed, unit);
    if (target != nullptr) ray.direction = *target - ray.origin;
    // The lamp itself may be such a layer: stop when what is left no longer points ahead.
    if (glm::dot(ray.direction, unit) <= 0) return share;
  }
  return glm::vec3(0.0f);
}

template <class Scatter>
glm::vec3 LightTransport::suns_at(const trace::Surface& s, const Scatter& scatter, Sampler& sampler) const {
  const auto& suns = lights_.suns();
  if (suns.empty()) return glm::vec3(0.0f);
  glm::vec3 sum(0.0f);
  const bool each = suns.size() <= kSunsEach;
  const std::size_t first =
      each ? 0
           : std::min(static_cast<std::size_t>(sampler.next_1d() * static_cast<float>(suns.size())), suns.size() - 1);
  const std::size_t end = each ? suns.size() : first + 1;
  const float scale = each ? 1.0f : static_cast<float>(suns.size());
  for (std::size_t i = first; i < end; ++i) {
    const SunLight& sun = suns[i];
    glm::vec3 wi = sun.towards;
    glm::vec3 light = sun.irradiance;
    float pdf = 0;
    if (sun.is_disc()) {
      const glm::vec3 d = sample_cap(sampler.next_2d(), sun.chord2);
      wi = glm::normalize(sun.tangent * d.x + sun.bitangent * d.y + sun.towards * d.z);
      light = sun.radiance / sun.pdf();
    }
    const glm::vec3 f = scatter.evaluate(wi, pdf);
    if (largest(f) <= 0) continue;
    const float weight = Scatter::kSunByDirection && sun.is_disc() ? mis_weight(sun.pdf() / scale, pdf) : 1.0f;
    sum += f * light * visibility(s, wi, nullptr) * (weight * scale);
  }
  return sum;
}

template <class Scatter>
glm::vec3 LightTransport::punctual_at(const trace::Surface& s, const Scatter& scatter, Sampler& sampler,
                                      std::size_t picks) const {
  if (!lights_.has_punctual()) return glm::vec3(0.0f);
  std::array<PunctualDraw, kMostPicks> draws;
  const std::size_t made = lights_.draw_punctual(s.position, scatter.normal(), scatter.transmits(), sampler.next_1d(),
                                                 std::span(draws).first(picks));
  glm::vec3 sum(0.0f);
  for (const auto& light : std::span(draws).first(made)) {
    if (largest(light.irradiance) <= 0) continue;
    const glm::vec3 to = light.position - s.position;
    const float square = glm::dot(to, to);
    if (!(square > 1e-20f)) continue;
    float pdf = 0;
    const glm::vec3 f = scatter.evaluate(to * (1.0f / std::sqrt(square)), pdf);
    if (largest(f) > 0) sum += f * light.irradiance * visibility(s, to, &light.position);
  }
  return sum;
}

template <class Scatter>
glm::vec3 LightTransport::emitters_at(const trace::Surface& s, const Scatter& scatter, Sampler& sampler) const {
  if (!lights_.has_emitters() || options_.emitters == TransportOptions::Emitters::kByDirection) return glm::vec3(0.0f);
  const float pick = sampler.next_1d();
  const EmitterDraw light = lights_.draw_emitter(pick, sampler.next_2d());
  if (!(light.pdf_area > 0) || largest(light.radiance) <= 0) return glm::vec3(0.0f);
  const glm::vec3 to = light.position - s.position;
  const float square = glm::dot(to, to);
  if (!(square > 1e-20f)) return glm::vec3(0.0f);
  const glm::vec3 wi = to * (1.0f / std::sqrt(square));
  float cosine = -glm::dot(light.normal, wi);
  if (light.double_sided) cosine = std::abs(cosine);
  if (!(cosine > 1e-6f)) return glm::vec3(0.0f);
  float pdf = 0;
  const glm::vec3 f = scatter.evaluate(wi, pdf);
  if (largest(f) <= 0) return glm::vec3(0.0f);
  const float light_pdf = light.pdf_area * square / cosine;
  const float weight = options_.emitters == TransportOptions::Emitters::kBoth ? mis_weight(light_pdf, pdf) : 1.0f;
  return f * light.radiance * visibility(s, to, &light.position) * (weight / light_pdf);
}

// Walks to the next surface that scatters; passes BLEND and clear ones by chance. False: left the scene (or gave up).
bool LightTransport::next_surface(Path& path, trace::Surface& s, MaterialPoint& m, Sampler& sampler) const {
  trace::Hit hit;
  glm::vec3 segment_start = path.ray.origin;
  for (int layer = 0; layer < kMostLayers; ++layer) {
    if (!(path.camera ? rays_->closest_camera(path.ray, hit) : rays_->closest(path.ray, hit))) return false;
    const auto& placed = rays_->instance(hit.instance);
    scene::prefetch(*scene_, *placed.material, *placed.mesh, hit.triangle, hit.u, hit.v);
    s = trace::make_surface(*rays_, hit);
    m = make_material_point(*scene_, s);
    const auto& material = *s.placed->material;
    if (!s.front && material.thickness > 0 && material.attenuation_distance > 0) {
      // Beer-Lambert over the way inside (KHR_materials_volume); the way back from this face was all in the volume.
      const float way = glm::length(s.position - segment_start) / material.attenuation_distance;
      path.throughput *= glm::pow(glm::max(material.attenuation_color, glm::vec3(1e-6f)), glm::vec3(way));
    }
    if (!any_passing_ || (m.alpha >= 1.0f && !m.passes_straight())) return true;
    const glm::vec3 through = m.straight_through(std::abs(glm::dot(s.normal, path.ray.direction)));
    const float chance = std::min(largest(through), 1.0f);
    if (sampler.next_1d() >= chance) {
      path.throughput *= m.alpha / (1.0f - chance);
      return true;
    }
    path.throughput *= through / chance;
    segment_start = s.position;
    path.ray.origin = trace::spawn_origin(s, path.ray.direction);
  }
  path.throughput = glm::vec3(0.0f);
  return false;
}

glm::vec3 LightTransport::background(const Path& path) const {
  glm::vec3 sum = has_sky_ ? scene_->sky.radiance(path.ray.direction) : glm::vec3(0.0f);
  if (path.suns_done) return sum;
  const float scale = lights_.suns().size() <= kSunsEach ? 1.0f : 1.0f / static_cast<float>(lights_.suns().size());
  for (const auto& sun : lights_.suns()) {
    if (!sun.is_disc() || !sun.covers(path.ray.direction)) continue;
    sum += sun.radiance * (path.pdf > 0 ? mis_weight(path.pdf, sun.pdf() * scale) : 1.0f);
  }
  return sum;
}

glm::vec3 LightTransport::emission_seen(const Path& path, const trace::Surface& s, const MaterialPoint& m) const {
  if (largest(m.emission) <= 0 || (!s.front && !s.placed->material->double_sided)) return glm::vec3(0.0f);
  if (path.pdf <= 0 || m.unlit) return m.emission;
  const float light_pdf = lights_.emitter_pdf(s.instance, s.triangle);
  if (!(light_pdf > 0) || options_.emitters == TransportOptions::Emitters::kByDirection) return m.emission;
  if (options_.emitters == TransportOptions::Emitters::kByLight) return glm::vec3(0.0f);
  const glm::vec3 to = s.position - path.from;
  const float cosine = std::max(std::abs(glm::dot(s.geometric_normal, path.ray.direction)), 1e-6f);
  return m.emission * mis_weight(path.pdf, light_pdf * glm::dot(to, to) / cosine);
}

// Adds what is stored of the diffuse light of `s`, and takes its lobe out. True: the path ends here. Surfaces that emit
// are left to the path: their own light is not part of what is stored and would have to be told apart.
bool LightTransport::end_in_stored_light(Path& path, const trace::Surface& s, const MaterialPoint& m, Bsdf& scatter,
                                         Sampler& sampler, glm::vec3& light) const {
  const glm::vec3 way = s.position - path.from;
  const float least = path.stored->least_distance();
  if (m.unlit || largest(s.placed->material->emissive) > 0 || glm::dot(way, way) < least * least) return false;
  const StoredTexel* known = path.stored->find(s, sampler.next_2d());
  if (known == nullptr) return false;
  const glm::vec3 sharp = path.sharp_seen ? sharp_diffuse(s, sampler) : known->sharp;
  light += path.throughput * scatter.take_diffuse() * (sharp + known->soft);
  // The other lobes of most surfaces scatter a twentieth of the light: one path in twenty goes on for them.
  const float goes_on = std::min(scatter.scattered(), 1.0f);
  if (!(sampler.next_1d() < goes_on)) return true;
  path.throughput /= goes_on;
  return false;
}

glm::vec3 LightTransport::trace_path(Path path, Sampler& sampler) const {
  glm::vec3 light(0.0f);
  trace::Surface s;
  MaterialPoint m;
  while (true) {
    if (!next_surface(path, s, m, sampler)) return light + path.throughput * background(path);
    if (sees_black(s)) return light;
    light += path.throughput * emission_seen(path, s, m);
    if (m.unlit || path.bounce >= options_.max_bounces) return light;
    BsdfScatter scatter(s, m, -path.ray.direction);
    if (path.stored != nullptr && end_in_stored_light(path, s, m, scatter, sampler, light)) return light;
    light += path.throughput *
             (suns_at(s, scatter, sampler) + punctual_at(s, scatter, sampler, 1) + emitters_at(s, scatter, sampler));
    const BsdfSample next = scatter.sample(sampler);
    if (!(next.pdf > 0)) return light;
    path.throughput *= next.weight;
    ++path.bounce;
    float survival = largest(path.throughput);
    if (!(survival > 0)) return light;
    if (path.bounce > options_.roulette_after && survival < 1.0f) {
      if (sampler.next_1d() >= survival) return light;
      path.throughput /= survival;
    }
    path.ray = {trace::spawn_origin(s, next.direction), 0.0f, next.direction, 1e30f};
    path.from = s.position;
    path.pdf = next.pdf;
    path.camera = false;
    path.suns_done = false;
  }
}

glm::vec3 LightTransport::sharp_diffuse(const trace::Surface& s, Sampler& sampler) const {
  const DiffuseScatter scatter{s};
  return finite_or_black(suns_at(s, scatter, sampler) + punctual_at(s, scatter, sampler, kMostPicks));
}

glm::vec3 LightTransport::soft_diffuse(const trace::Surface& s, Sampler& sampler, const StoredLight* stored) const {
  const DiffuseScatter scatter{s};
  glm::vec3 soft = emitters_at(s, scatter, sampler);
  glm::vec3 t, b;
  trace::make_frame(s.normal, t, b);
  const glm::vec3 d = sample_cosine(sampler.next_2d());
  const glm::vec3 wi = glm::normalize(t * d.x + b * d.y + s.normal * d.z);
  Path path;
  const glm::vec3 weight = scatter.evaluate(wi, path.pdf);
  if (path.pdf > 0) {
    path.throughput = weight / path.pdf;
    path.ray = {trace::spawn_origin(s, wi), 0.0f, wi, 1e30f};
    path.from = s.position;
    path.bounce = 1;
    path.suns_done = true;
    path.stored = stored;
    soft += trace_path(path, sampler);
  }
  return finite_or_black(soft);
}

ViewIndependentLight LightTransport::view_independent(const SurfacePoint& point, Sampler& sampler) const {
  const auto s = trace::make_surface(*rays_, point);
  if (sees_black(s)) return {};
  const auto m = make_material_point(*scene_, s);
  const glm::vec3 albedo = m.diffuse_albedo();
  ViewIndependentLight made;
  if (largest(albedo) > 0) {
    made.sharp = sharp_diffuse(s, sampler) * albedo;
    made.soft = soft_diffuse(s, sampler, nullptr) * albedo;
  }
  if (s.front || s.placed->material->double_sided) made.sharp += m.emission;
  return made;
}

glm::vec3 LightTransport::sharp_light(const SurfacePoint& point, Sampler& sampler) const {
  const auto& material = *rays_->instance(point.instance).material;
  if (sees_black(material, point.front) || !may_diffuse(material)) return glm::vec3(0.0f);
  return sharp_diffuse(trace::make_surface(*rays_, point), sampler);
}

glm::vec3 LightTransport::soft_light(const SurfacePoint& point, Sampler& sampler, const StoredLight* stored) const {
  const auto& material = *rays_->instance(point.instance).material;
  if (sees_black(material, point.front) || !may_diffuse(material)) return glm::vec3(0.0f);
  return soft_diffuse(trace::make_surface(*rays_, point), sampler, stored);
}

ViewIndependentLight LightTransport::irradiance(const SurfacePoint& point, Sampler& sampler) const {
  const auto s = trace::make_surface(*rays_, point);
  if (sees_black(s)) return {};
  ViewIndependentLight made;
  made.sharp = sharp_diffuse(s, sampler) * kPi;
  made.soft = soft_diffuse(s, sampler, nullptr) * kPi;
  return made;
}

glm::vec3 LightTransport::diffuse_albedo(const SurfacePoint& point) const {
  const auto& placed = rays_->instance(point.instance);
  if (sees_black(*placed.material, point.front)) return glm::vec3(0.0f);
  return make_material_point(*scene_, placed, point.triangle, point.u, point.v).diffuse_albedo();
}

glm::vec3 LightTransport::emission(const SurfacePoint& point) const {
  const auto& placed = rays_->instance(point.instance);
  if (!point.front && !placed.material->double_sided) return glm::vec3(0.0f);
  return make_material_point(*scene_, placed, point.triangle, point.u, point.v).emission;
}

float LightTransport::alpha(const SurfacePoint& point) const {
  return make_material_point(*scene_, trace::make_surface(*rays_, point)).alpha;
}

glm::vec3 LightTransport::transparency(const SurfacePoint& point) const {
  return make_material_point(*scene_, trace::make_surface(*rays_, point)).view_independent_transparency();
}

ViewDependentLight LightTransport::view_dependent(const SurfacePoint& point, const glm::vec3& eye, Sampler& sampler,
                                                  const StoredLight* stored) const {
  const auto s = trace::make_surface(*rays_, point);
  ViewDependentLight made;
  glm::vec3 wo = eye - s.position;
  made.distance = glm::length(wo);
  if (!(made.distance > 1e-12f) || sees_black(s)) return made;
  wo *= 1.0f / made.distance;
  const float cosine = glm::dot(wo, s.geometric_normal);
  if (cosine < 0) wo -= s.geometric_normal * (2.0f * cosine);
  const auto m = make_material_point(*scene_, s);
  made.ggx_alpha = m.ggx_alpha;
  if (m.unlit) return made;
  if (m.interface) made.diffuse_factor = diffuse_view_factor(std::max(glm::dot(wo, s.normal), 0.0f));
  if (!m.thin && m.passes_straight()) {
    const glm::vec3 light = full_radiance({trace::spawn_origin(s, wo), 0.0f, -wo, 1e30f}, sampler);
    made.radiance = finite_or_black(light - m.emission);
    return made;
  }
  const BsdfScatter scatter(s, m, wo, Lobes::kSpecular);
  glm::vec3 light =
      suns_at(s, scatter, sampler) + punctual_at(s, scatter, sampler, 1) + emitters_at(s, scatter, sampler);
  if (const BsdfSample next = scatter.sample(sampler); next.pdf > 0) {
    Path path;
    path.throughput = next.weight;
    path.ray = {trace::spawn_origin(s, next.direction), 0.0f, next.direction, 1e30f};
    path.from = s.position;
    path.pdf = next.pdf;
    path.bounce = 1;
    path.stored = stored;
    path.sharp_seen = true;
    light += trace_path(path, sampler);
  }
  made.radiance = finite_or_black(light);
  return made;
}

glm::vec3 LightTransport::clear_tint(const SurfacePoint& point) const {
  const auto m = make_material_point(*scene_, trace::make_surface(*rays_, point));
  return m.thin && m.passes_straight() ? m.base * (m.alpha * (1.0f - m.metallic) * m.transmission) : glm::vec3(0.0f);
}

glm::vec3 LightTransport::full_radiance(const trace::Ray& ray, Sampler& sampler) const {
  Path path;
  path.ray = ray;
  path.from = ray.origin;
  path.camera = true;
  return finite_or_black(trace_path(path, sampler));
}

glm::vec3 LightTransport::view_independent_radiance(const trace::Ray& camera_ray, Sampler& sampler) const {
  glm::vec3 light(0.0f);
  Path path;
  path.ray = camera_ray;
  trace::Hit hit;
  for (int layer = 0; layer < kMostLayers; ++layer) {
    if (!rays_->closest_camera(path.ray, hit)) return light + path.throughput * background(path);
    const auto s = trace::make_surface(*rays_, hit);
    const auto m = make_material_point(*scene_, s);
    if (!sees_black(s)) {
      const glm::vec3 albedo = m.diffuse_albedo();
      glm::vec3 own = s.front || s.placed->material->double_sided ? m.emission : glm::vec3(0.0f);
      if (largest(albedo) > 0 && m.alpha > 0)
        own += albedo * (sharp_diffuse(s, sampler) + soft_diffuse(s, sampler, nullptr));
      light += path.throughput * own * m.alpha;
    }
    if (!may_pass(*s.placed->material)) return light;
    path.throughput *= m.view_independent_transparency();
    if (largest(path.throughput) < 1e-4f) return light;
    path.ray.origin = trace::spawn_origin(s, path.ray.direction);
  }
  return light;
}

}  // namespace darm::renderer
