#include "daemon/scene_setup.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "daemon/config/camera_spec.hpp"

namespace darm {
namespace {

scene::Light to_light(const config::LightConfig& from) {
  scene::Light light;
  const bool spot = from.kind == config::LightKind::kSpot;
  light.kind = spot ? scene::LightKind::kSpot : scene::LightKind::kPoint;
  light.position = glm::vec3(from.position);
  light.intensity = glm::vec3(from.intensity);
  if (spot) {
    light.direction = glm::vec3(glm::normalize(from.direction));
    light.cos_outer = static_cast<float>(std::cos(glm::radians(from.cone_degrees)));
    light.cos_inner = static_cast<float>(std::cos(glm::radians(from.inner_cone_degrees)));
  }
  return light;
}

Camera overview(const scene::Scene& scene) {
  const glm::dvec3 low = glm::dvec3(scene.bounds_min) + scene.origin;
  const glm::dvec3 high = glm::dvec3(scene.bounds_max) + scene.origin;
  const glm::dvec3 centre = 0.5 * (low + high);
  const double radius = std::max(1e-6, 0.5 * glm::length(high - low));
  // A sphere of `radius` fills a 50 degree view from radius / sin(25 degrees).
  return look_at(centre + glm::normalize(glm::dvec3(0.6, 0.5, 1.0)) * (radius / std::sin(glm::radians(25.0))), centre,
                 50.0);
}

}  // namespace

scene::LightSetup light_setup(const config::Config& config) {
  scene::LightSetup setup;
  if (config.sun) {
    scene::Sun sun;
    sun.direction = glm::vec3(glm::normalize(config.sun->direction));
    sun.irradiance = glm::vec3(config.sun->irradiance);
    sun.angular_diameter_degrees = static_cast<float>(config.sun->angular_diameter_degrees);
    setup.sun = sun;
  }
  if (config.sky) {
    setup.sky =
        scene::Sky{glm::vec3(config.sky->zenith), glm::vec3(config.sky->horizon), glm::vec3(config.sky->ground)};
  }
  for (const auto& light : config.lights) setup.extra_lights.push_back(to_light(light));
  return setup;
}

Result<std::shared_ptr<const scene::Scene>> load_configured_scene(const config::Config& config) {
  if (config.scene.file.empty())
    return fail("no scene: give one with --scene FILE or [scene] file in the configuration");
  return scene::load_scene(config.scene.file, light_setup(config));
}

Result<Camera> find_camera(const config::Config& config, const scene::Scene& scene, const std::string& spec) {
  auto named = config.cameras;
  named.insert(named.end(), config.load_cameras.begin(), config.load_cameras.end());
  return config::parse_camera_spec(spec, named, scene.cameras);
}

Camera start_camera(const config::Config& config, const scene::Scene& scene) {
  if (!config.cameras.empty()) {
    return config::camera_of(config.cameras.front());
  }
  if (!scene.cameras.empty()) return scene.cameras.front().camera;
  return overview(scene);
}

}  // namespace darm
