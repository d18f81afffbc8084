#include "actors/renderer/light_transport.hpp"

#include <utility>

namespace darm::renderer {
namespace {

MaterialPoint material_at(const TransportWorld& world, const SurfacePoint& point) {
  return make_material_point(*world.scene, world.rays->instance(point.instance), point.triangle, point.u, point.v);
}

}  // namespace

LightTransport::LightTransport(std::shared_ptr<const scene::Scene> scene, std::shared_ptr<const trace::RayScene> rays,
                               TransportOptions options)
    : plan_(scene::plan_effects(*scene)) {
  LightSet lights(*rays);
  world_ = std::make_shared<const TransportWorld>(
      TransportWorld{std::move(scene), std::move(rays), options, std::move(lights)});
  integrator_ = smallest_cover(options.all_effects ? kAllEffects : effects_of(plan_)).make(world_);
}

ViewIndependentLight LightTransport::view_independent(const SurfacePoint& point, Sampler& sampler) const {
  return integrator_->view_independent(point, sampler);
}

glm::vec3 LightTransport::sharp_light(const SurfacePoint& point, Sampler& sampler) const {
  return integrator_->sharp_light(point, sampler);
}

glm::vec3 LightTransport::soft_light(const SurfacePoint& point, Sampler& sampler, const StoredLight* stored) const {
  return integrator_->soft_light(point, sampler, stored);
}

ViewIndependentLight LightTransport::irradiance(const SurfacePoint& point, Sampler& sampler) const {
  return integrator_->irradiance(point, sampler);
}

glm::vec3 LightTransport::diffuse_albedo(const SurfacePoint& point) const { return integrator_->diffuse_albedo(point); }

glm::vec3 LightTransport::emission(const SurfacePoint& point) const {
  const auto& material = *rays().instance(point.instance).material;
  if (!point.front && !material.double_sided) return glm::vec3(0.0f);
  return material.emits() || material.unlit ? material_at(*world_, point).emission : glm::vec3(0.0f);
}

float LightTransport::alpha(const SurfacePoint& point) const { return material_at(*world_, point).alpha; }

glm::vec3 LightTransport::transparency(const SurfacePoint& point) const {
  return material_at(*world_, point).view_independent_transparency();
}

ViewDependentLight LightTransport::view_dependent(const SurfacePoint& point, const glm::vec3& eye, Sampler& sampler,
                                                  const StoredLight* stored) const {
  return integrator_->view_dependent(point, eye, sampler, stored);
}

glm::vec3 LightTransport::clear_tint(const SurfacePoint& point) const {
  const auto m = material_at(*world_, point);
  return m.thin && m.passes_straight() ? m.base * (m.alpha * (1.0f - m.metallic) * m.transmission) : glm::vec3(0.0f);
}

glm::vec3 LightTransport::full_radiance(const trace::Ray& ray, Sampler& sampler) const {
  return integrator_->full_radiance(ray, sampler);
}

glm::vec3 LightTransport::view_independent_radiance(const trace::Ray& ray, Sampler& sampler) const {
  return integrator_->view_independent_radiance(ray, sampler);
}

}  // namespace darm::renderer
