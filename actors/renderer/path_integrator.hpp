// Path tracing with next-event estimation and MIS (power heuristic). A template over the scene's effects: what a scene
// has not is not in the code. Included only where integrators are instantiated.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <utility>

#include "actors/renderer/direct_light.hpp"

namespace darm::renderer {

namespace detail {

[[nodiscard]] inline glm::vec3 finite_or_black(const glm::vec3& v) {
  return std::isfinite(v.x + v.y + v.z) ? glm::max(v, glm::vec3(0.0f)) : glm::vec3(0.0f);
}

// The back of a single-sided surface, unless light may come through from its front: the far wall of a frosted body.
[[nodiscard]] inline bool sees_black(const scene::Material& m, bool front) {
  return !front && !m.double_sided && !(m.transmission > 0);
}
[[nodiscard]] inline bool sees_black(const trace::Surface& s) { return sees_black(*s.placed->material, s.front); }

/// A ray on its way, and what the strategies need to know about where it comes from.
struct Path {
  trace::Ray ray;
  glm::vec3 throughput{1.0f};
  glm::vec3 from{0.0f};  // last scattering vertex
  float pdf = 0;         // of the direction, per steradian; 0: no other strategy could have made it
  std::uint32_t bounce = 0;
  bool camera = false;     // sees through the backs of single-sided triangles
  bool suns_done = false;  // the vertex before took its suns by shadow rays alone
  const StoredLight* stored = nullptr;
  const BrightTexels::Aim* aim = nullptr;  // a point of bright texels may have been drawn, too, where it comes from
  bool sharp_seen = false;  // what it meets is seen in a mirror: sharp light is taken there, not from coarse texels

  // The light that is stored was made with normals bent: a path that ends in it need not look at them.
  [[nodiscard]] bool bends_late() const { return stored != nullptr && !sharp_seen; }
};

/// What becomes of a path at a surface whose light may be stored.
enum class AtStored : std::uint8_t { kEnds, kGoesOn, kUnknown };

}  // namespace detail

template <Effects fx>
class PathIntegrator final : public Integrator, DirectLight<fx> {
  using Path = detail::Path;
  using DirectLight<fx>::scene_, DirectLight<fx>::rays_, DirectLight<fx>::lights_, DirectLight<fx>::options;
  using DirectLight<fx>::surface_at, DirectLight<fx>::material_at;
  using DirectLight<fx>::suns_at, DirectLight<fx>::lamps_at, DirectLight<fx>::emitters_at, DirectLight<fx>::visibility;

 public:
  explicit PathIntegrator(std::shared_ptr<const TransportWorld> world) : DirectLight<fx>(std::move(world)) {}

  [[nodiscard]] Effects effects() const override { return fx; }

  [[nodiscard]] ViewIndependentLight view_independent(const SurfacePoint& point, Sampler& sampler) const override {
    Walk walk(sampler);
    const auto s = surface_at(point, walk);
    if (detail::sees_black(s)) return {};
    const auto m = material_at(s, walk);
    const glm::vec3 albedo = m.diffuse_albedo();
    ViewIndependentLight made;
    if (detail::largest(albedo) > 0) {
      made.sharp = sharp_diffuse(s, walk) * albedo;
      made.soft = soft_diffuse(s, walk, nullptr) * albedo;
    }
    if (s.front || s.placed->material->double_sided) made.sharp += m.emission;
    return made;
  }

  [[nodiscard]] glm::vec3 sharp_light(const SurfacePoint& point, Sampler& sampler) const override {
    if (!takes_diffuse_light(point)) return glm::vec3(0.0f);
    Walk walk(sampler);
    return sharp_diffuse(surface_at(point, walk), walk);
  }

  [[nodiscard]] glm::vec3 soft_light(const SurfacePoint& point, Sampler& sampler,
                                     const StoredLight* stored) const override {
    if (!takes_diffuse_light(point)) return glm::vec3(0.0f);
    Walk walk(sampler);
    return soft_diffuse(surface_at(point, walk), walk, stored);
  }

  [[nodiscard]] ViewIndependentLight irradiance(const SurfacePoint& point, Sampler& sampler) const override {
    Walk walk(sampler);
    const auto s = surface_at(point, walk);
    if (detail::sees_black(s)) return {};
    ViewIndependentLight made;
    made.sharp = sharp_diffuse(s, walk) * kPi;
    made.soft = soft_diffuse(s, walk, nullptr) * kPi;
    return made;
  }

  [[nodiscard]] glm::vec3 diffuse_albedo(const SurfacePoint& point) const override {
    const auto& placed = rays_.instance(point.instance);
    if (detail::sees_black(*placed.material, point.front)) return glm::vec3(0.0f);
    static const scene::TextureSet kNone;
    const scene::HitTextures textures(fx.textures ? placed.textures : kNone, *placed.mesh, point.triangle, point.u,
                                      point.v);
    return read_material<fx>(scene_, placed, {point.triangle, point.u, point.v}, textures, thread_tally())
        .diffuse_albedo();
  }

  [[nodiscard]] ViewDependentLight view_dependent(const SurfacePoint& point, const glm::vec3& eye, Sampler& sampler,
                                                  const StoredLight* stored) const override {
    Walk walk(sampler);
    const auto s = surface_at(point, walk);
    ViewDependentLight made;
    glm::vec3 wo = eye - s.position;
    made.distance = glm::length(wo);
    if (!(made.distance > 1e-12f) || detail::sees_black(s)) return made;
    wo *= 1.0f / made.distance;
    const float cosine = glm::dot(wo, s.geometric_normal);
    if (cosine < 0) wo -= s.geometric_normal * (2.0f * cosine);
    const auto m = material_at(s, walk);
    made.ggx_alpha = m.ggx_alpha;
    if (m.unlit) return made;
    if (m.interface) made.diffuse_factor = diffuse_view_factor(std::max(glm::dot(wo, s.normal), 0.0f));
    made.beneath = known_light(s, m, stored);
    if (fx.straight && !m.thin && m.passes_straight()) {
      const glm::vec3 light = full_radiance({trace::spawn_origin(s, wo), 0.0f, -wo, 1e30f}, sampler);
      made.radiance = detail::finite_or_black(light - m.emission);
      return made;
    }
    made.radiance = detail::finite_or_black(specular_light(s, m, wo, walk, stored));
    return made;
  }

  [[nodiscard]] glm::vec3 full_radiance(const trace::Ray& ray, Sampler& sampler) const override {
    Walk walk(sampler);
    Path path;
    path.ray = ray;
    path.from = ray.origin;
    path.camera = true;
    return detail::finite_or_black(trace_path(path, walk));
  }

  [[nodiscard]] glm::vec3 view_independent_radiance(const trace::Ray& camera_ray, Sampler& sampler) const override {
    Walk walk(sampler);
    glm::vec3 light(0.0f);
    Path path;
    path.ray = camera_ray;
    trace::Hit hit;
    for (int layer = 0; layer < detail::kMostLayers; ++layer) {
      if (!rays_.closest_camera(path.ray, hit)) return light + path.throughput * background(path, walk);
      const auto s = surface_at({hit.instance, hit.triangle, hit.u, hit.v, hit.front}, walk);
      const auto m = material_at(s, walk);
      if (!detail::sees_black(s)) {
        const glm::vec3 albedo = m.diffuse_albedo();
        glm::vec3 own = s.front || s.placed->material->double_sided ? m.emission : glm::vec3(0.0f);
        if (detail::largest(albedo) > 0 && m.alpha > 0)
          own += albedo * (sharp_diffuse(s, walk) + soft_diffuse(s, walk, nullptr));
        light += path.throughput * own * m.alpha;
      }
      if (!fx.straight || !may_pass(*s.placed->material)) return light;
      path.throughput *= m.view_independent_transparency();
      if (detail::largest(path.throughput) < 1e-4f) return light;
      path.ray.origin = trace::spawn_origin(s, path.ray.direction);
    }
    return light;
  }

 private:
  [[nodiscard]] bool takes_diffuse_light(const SurfacePoint& point) const {
    const auto& material = *rays_.instance(point.instance).material;
    return !detail::sees_black(material, point.front) && may_diffuse(material);
  }

  /// Luminance of light that does not depend on the eye, where `stored` knows it; else 0.
  [[nodiscard]] static float known_light(const trace::Surface& s, const auto& m, const StoredLight* stored) {
    const auto* texel = stored != nullptr ? stored->find(s, glm::vec2(0.5f)) : nullptr;
    if (texel == nullptr) return 0.0f;
    const float light = luminance(m.diffuse_albedo() * (texel->sharp + texel->soft) + m.emission);
    return std::isfinite(light) ? light : 0.0f;
  }

  /// Suns and lamps at a first vertex.
  [[nodiscard]] glm::vec3 sharp_diffuse(const trace::Surface& s, Walk& walk) const {
    walk.tally.add(EffectKind::kDiffuseReflection);
    const DiffuseScatter scatter{s};
    return detail::finite_or_black(suns_at(s, scatter, walk) + lamps_at(s, scatter, walk, detail::kMostPicks));
  }

  /// All other light there.
  [[nodiscard]] glm::vec3 soft_diffuse(const trace::Surface& s, Walk& walk, const StoredLight* stored) const {
    walk.tally.add(EffectKind::kDiffuseReflection);
    const DiffuseScatter scatter{s};
    glm::vec3 soft = emitters_at(s, scatter, walk);
    glm::vec3 t, b;
    trace::make_frame(s.normal, t, b);
    const glm::vec3 d = sample_cosine(walk.sampler.next_2d());
    const glm::vec3 wi = glm::normalize(t * d.x + b * d.y + s.normal * d.z);
    Path path;
    const glm::vec3 weight = scatter.evaluate(wi, path.pdf);
    BrightTexels::Aim aim;
    soft += bright_at(s, scatter, stored, aim, walk);
    if (path.pdf > 0) {
      path.throughput = weight / path.pdf;
      path.ray = {trace::spawn_origin(s, wi), 0.0f, wi, 1e30f};
      path.from = s.position;
      path.bounce = 1;
      path.suns_done = true;
      path.stored = stored;
      path.aim = &aim;
      soft += trace_path(path, walk);
    }
    return detail::finite_or_black(soft);
  }

  /// A point of a bright texel, against directions that find it by chance: those know of it by `aim`, which is set.
  template <class Scatter>
  [[nodiscard]] glm::vec3 bright_at(const trace::Surface& s, const Scatter& scatter, const StoredLight* known_light,
                                    BrightTexels::Aim& aim, Walk& walk) const {
    if (known_light == nullptr || known_light->bright().empty()) return glm::vec3(0.0f);
    const StoredLight& stored = *known_light;
    const StoredTexel* here = stored.find(s, glm::vec2(0.5f));
    aim = stored.bright().aim(s.position, scatter.normal(), here != nullptr ? luminance(here->soft) : -1.0f);
    const float chance = walk.sampler.next_1d();
    const float pick = walk.sampler.next_1d();
    const glm::vec2 place = walk.sampler.next_2d();
    const glm::vec2 corner = walk.sampler.next_2d();
    if (!(chance < aim.chance)) return glm::vec3(0.0f);
    const auto drawn = stored.bright().draw(aim, pick, place);
    if (!drawn) return glm::vec3(0.0f);
    trace::Surface to;
    MaterialPoint m;
    look_at({0, drawn->instance, drawn->triangle, drawn->u, drawn->v, drawn->front}, false, to, m, walk);
    const glm::vec3 way = to.position - s.position;
    const float square = glm::dot(way, way);
    if (!ends_at(to, m, square, stored)) return glm::vec3(0.0f);
    const glm::vec3 wi = way * (1.0f / std::sqrt(square));
    float pdf = 0;
    const glm::vec3 f = scatter.evaluate(wi, pdf);
    const float light_pdf = aimed_pdf(aim, stored, to, wi, square);
    const StoredTexel* known = stored.find(to, corner);
    if (!(pdf > 0) || !(light_pdf > 0) || known == nullptr) return glm::vec3(0.0f);
    const glm::vec3 light = diffuse_share(m, to, wi) * (known->sharp + known->soft);
    if (detail::largest(light) <= 0) return glm::vec3(0.0f);
    return f * light * visibility(s, way, &to.position, walk) * (mis_weight(light_pdf, pdf) / light_pdf);
  }

  /// Density per steradian, times its chance, with which bright_at() draws `to`, which is `square` away (squared).
  [[nodiscard]] static float aimed_pdf(const BrightTexels::Aim& aim, const StoredLight& stored,
                                       const trace::Surface& to, const glm::vec3& direction, float square) {
    const float cosine = -glm::dot(to.geometric_normal, direction);
    if (!(cosine > 1e-6f)) return 0.0f;
    const SurfacePoint point{to.instance, to.triangle, to.u, to.v, to.front};
    return aim.chance * stored.bright().pdf_area(aim, point, to.area) * square / cosine;
  }

  /// What specular and transmission lobes send towards `wo`.
  [[nodiscard]] glm::vec3 specular_light(const trace::Surface& s, const MaterialPoint& m, const glm::vec3& wo,
                                         Walk& walk, const StoredLight* stored) const {
    const auto scatter = scatter_at(s, m, wo, Lobes::kSpecular, walk);
    glm::vec3 light = suns_at(s, scatter, walk) + lamps_at(s, scatter, walk, 1) + emitters_at(s, scatter, walk);
    if (const BsdfSample next = scatter.sample(walk.sampler); next.pdf > 0) {
      Path path;
      path.throughput = next.weight;
      path.ray = {trace::spawn_origin(s, next.direction), 0.0f, next.direction, 1e30f};
      path.from = s.position;
      path.pdf = next.pdf;
      path.bounce = 1;
      path.stored = stored;
      path.sharp_seen = true;
      light += trace_path(path, walk);
    }
    return light;
  }

  [[nodiscard]] BsdfScatter<fx> scatter_at(const trace::Surface& s, const MaterialPoint& m, const glm::vec3& wo,
                                           Lobes lobes, Walk& walk) const {
    if (lobes == Lobes::kAll) walk.tally.add(EffectKind::kDiffuseReflection);
    if constexpr (fx.glossy) walk.tally.add(EffectKind::kGlossyReflection);
    if constexpr (fx.transmission) walk.tally.add(EffectKind::kTransmission);
    return BsdfScatter<fx>(s, m, wo, lobes);
  }

  /// Surface and material of a hit. Paths that may end in stored light have their normals bent later, if they go on:
  /// the light that is stored was made with them.
  void look_at(const trace::Hit& hit, bool bend, trace::Surface& s, MaterialPoint& m, Walk& walk) const {
    const auto& placed = rays_.instance(hit.instance);
    static const scene::TextureSet kNone;
    constexpr bool kTextured = fx.textures || fx.normal_maps;
    const scene::HitTextures textures(kTextured ? placed.textures : kNone, *placed.mesh, hit.triangle, hit.u, hit.v);
    s = trace::make_unbent_surface(rays_, {hit.instance, hit.triangle, hit.u, hit.v, hit.front});
    if constexpr (fx.normal_maps)
      if (bend && s.has_normal_map()) {
        walk.tally.add(EffectKind::kNormalMaps);
        trace::bend_normal(s, textures.read(scene::TextureSet::kNormal, scene::TextureEncoding::kLinear));
      }
    m = material_at(s, textures, walk);
  }

  /// Beer-Lambert over the way inside (KHR_materials_volume); the way back from this face was all in the volume.
  void attenuate(Path& path, const trace::Surface& s, const glm::vec3& segment_start, Walk& walk) const {
    const auto& material = *s.placed->material;
    if (s.front || !(material.transmission > 0 && material.thickness > 0 && material.attenuation_distance > 0)) return;
    walk.tally.add(EffectKind::kVolumeAttenuation);
    const float way = glm::length(s.position - segment_start) / material.attenuation_distance;
    path.throughput *= glm::pow(glm::max(material.attenuation_color, glm::vec3(1e-6f)), glm::vec3(way));
  }

  /// Walks to the next surface that scatters; passes BLEND and clear ones by chance. False: left the scene (or gave
  /// up).
  [[nodiscard]] bool next_surface(Path& path, trace::Surface& s, MaterialPoint& m, Walk& walk) const {
    trace::Hit hit;
    glm::vec3 segment_start = path.ray.origin;
    for (int layer = 0; layer < detail::kMostLayers; ++layer) {
      if (!(path.camera ? rays_.closest_camera(path.ray, hit) : rays_.closest(path.ray, hit))) return false;
      look_at(hit, !path.bends_late(), s, m, walk);
      if constexpr (fx.transmission) attenuate(path, s, segment_start, walk);
      if constexpr (!fx.straight) return true;
      walk.tally.add(EffectKind::kBlending);
      if (m.alpha >= 1.0f && !m.passes_straight()) return true;
      const glm::vec3 through = m.straight_through(std::abs(glm::dot(s.normal, path.ray.direction)));
      const float chance = std::min(detail::largest(through), 1.0f);
      if (walk.sampler.next_1d() >= chance) {
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

  [[nodiscard]] glm::vec3 background(const Path& path, Walk& walk) const {
    glm::vec3 sum(0.0f);
    if constexpr (fx.sky) {
      walk.tally.add(EffectKind::kSky);
      sum = scene_.sky.radiance(path.ray.direction);
    }
    if (!fx.suns || path.suns_done) return sum;
    const auto& suns = lights_.suns();
    const float scale = suns.size() <= detail::kSunsEach ? 1.0f : 1.0f / static_cast<float>(suns.size());
    for (const auto& sun : suns) {
      if (!sun.is_disc() || !sun.covers(path.ray.direction)) continue;
      walk.tally.add(EffectKind::kAreaLights);
      sum += sun.radiance * (path.pdf > 0 ? mis_weight(path.pdf, sun.pdf() * scale) : 1.0f);
    }
    return sum;
  }

  [[nodiscard]] glm::vec3 emission_seen(const Path& path, const trace::Surface& s, const MaterialPoint& m,
                                        Walk& walk) const {
    using Emitters = TransportOptions::Emitters;
    if (detail::largest(m.emission) <= 0 || (!s.front && !s.placed->material->double_sided)) return glm::vec3(0.0f);
    walk.tally.add(EffectKind::kAreaLights);
    if (path.pdf <= 0 || m.unlit) return m.emission;
    const float light_pdf = lights_.emitter_pdf(s.instance, s.triangle);
    if (!(light_pdf > 0) || options().emitters == Emitters::kByDirection) return m.emission;
    if (options().emitters == Emitters::kByLight) return glm::vec3(0.0f);
    const glm::vec3 to = s.position - path.from;
    const float cosine = std::max(std::abs(glm::dot(s.geometric_normal, path.ray.direction)), 1e-6f);
    return m.emission * mis_weight(path.pdf, light_pdf * glm::dot(to, to) / cosine);
  }

  /// Surfaces that emit are left to the path: their own light is not part of what is stored and would have to be told
  /// apart. So are those that transmit: most of them have no diffuse light. `square`: of the way there.
  [[nodiscard]] static bool ends_at(const trace::Surface& s, const MaterialPoint& m, float square,
                                    const StoredLight& stored) {
    const float least = stored.least_distance();
    return !m.unlit && !(m.transmission > 0) && !(fx.emitters && s.placed->material->emits()) &&
           square >= least * least;
  }

  /// What the diffuse lobe of a surface that is met in `direction` sends back of irradiance / pi.
  [[nodiscard]] static glm::vec3 diffuse_share(const MaterialPoint& m, const trace::Surface& s,
                                               const glm::vec3& direction) {
    const float cosine = std::max(-glm::dot(s.normal, direction), 0.0f);
    return m.base * ((1.0f - m.metallic) * (1.0f - m.fresnel(cosine)));
  }

  /// Adds what is stored of the diffuse light of `s`, if anything is.
  [[nodiscard]] detail::AtStored end_in_stored_light(Path& path, const trace::Surface& s, const MaterialPoint& m,
                                                     Walk& walk, glm::vec3& light) const {
    const glm::vec3 way = s.position - path.from;
    const float square = glm::dot(way, way);
    if (!ends_at(s, m, square, *path.stored)) return detail::AtStored::kUnknown;
    const StoredTexel* known = path.stored->find(s, walk.sampler.next_2d());
    if (known == nullptr) return detail::AtStored::kUnknown;
    const glm::vec3 sharp = path.sharp_seen ? sharp_diffuse(s, walk) : known->sharp;
    glm::vec3 sent = path.throughput * diffuse_share(m, s, path.ray.direction) * (sharp + known->soft);
    if (path.aim != nullptr && path.aim->chance > 0)
      sent *= mis_weight(path.pdf, aimed_pdf(*path.aim, *path.stored, s, path.ray.direction, square));
    light += sent;
    if constexpr (!fx.glossy) return detail::AtStored::kEnds;
    const float cosine = std::max(-glm::dot(s.normal, path.ray.direction), 0.0f);
    // The other lobes of most surfaces scatter a twentieth of the light: one path in twenty goes on for them.
    const float goes_on = std::min(luminance(m.reflectance(cosine)), 1.0f);
    if (!(walk.sampler.next_1d() < goes_on)) return detail::AtStored::kEnds;
    path.throughput /= goes_on;
    return detail::AtStored::kGoesOn;
  }

  [[nodiscard]] glm::vec3 trace_path(Path path, Walk& walk) const {
    glm::vec3 light(0.0f);
    trace::Surface s;
    MaterialPoint m;
    BrightTexels::Aim aim;
    while (true) {
      if (!next_surface(path, s, m, walk)) return light + path.throughput * background(path, walk);
      if (detail::sees_black(s)) return light;
      if constexpr (fx.emitters) light += path.throughput * emission_seen(path, s, m, walk);
      if (m.unlit || path.bounce >= options().max_bounces) return light;
      Lobes lobes = Lobes::kAll;
      if (path.stored != nullptr) {
        const auto what = end_in_stored_light(path, s, m, walk, light);
        if (what == detail::AtStored::kEnds) return light;
        if (what == detail::AtStored::kGoesOn) lobes = Lobes::kSpecular;
        if (fx.normal_maps && path.bends_late()) bend_late(s, walk);
      }
      const auto scatter = scatter_at(s, m, -path.ray.direction, lobes, walk);
      light +=
          path.throughput * (suns_at(s, scatter, walk) + lamps_at(s, scatter, walk, 1) + emitters_at(s, scatter, walk));
      const bool aims = lobes == Lobes::kAll && !path.sharp_seen;
      if (aims) light += path.throughput * bright_at(s, scatter, path.stored, aim, walk);
      const BsdfSample next = scatter.sample(walk.sampler);
      if (!(next.pdf > 0)) return light;
      path.throughput *= next.weight;
      ++path.bounce;
      const float survival = detail::largest(path.throughput);
      if (!(survival > 0)) return light;
      if (path.bounce > options().roulette_after && survival < 1.0f) {
        if (walk.sampler.next_1d() >= survival) return light;
        path.throughput /= survival;
      }
      path.ray = {trace::spawn_origin(s, next.direction), 0.0f, next.direction, 1e30f};
      path.from = s.position;
      path.pdf = next.pdf;
      path.aim = aims ? &aim : nullptr;
      path.camera = false;
      path.suns_done = false;
    }
  }

  void bend_late(trace::Surface& s, Walk& walk) const {
    if (!s.has_normal_map()) return;
    walk.tally.add(EffectKind::kNormalMaps);
    trace::bend_normal(s, scene_);
  }
};

/// Makes a PathIntegrator<fx>; declared here, instantiated in integrators_*.cpp.
template <Effects fx>
[[nodiscard]] std::shared_ptr<const Integrator> make_path_integrator(std::shared_ptr<const TransportWorld> world) {
  return std::make_shared<const PathIntegrator<fx>>(std::move(world));
}

}  // namespace darm::renderer
