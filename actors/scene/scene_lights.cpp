#include "actors/scene/scene_lights.hpp"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <string>

namespace darm::scene {
namespace {

constexpr float kMaxSunDegrees = 90.0f;

bool is_radiance(const glm::vec3& v) {
  for (int c = 0; c < 3; ++c)
    if (!std::isfinite(v[c]) || v[c] < 0.0f) return false;
  return true;
}

bool is_direction(const glm::vec3& v) {
  const float length = glm::length(v);
  return std::isfinite(length) && length > 1e-12f;
}

/// A clear afternoon, five thousand times dimmer than outside: a white surface then sends back about as much as a glTF
/// material may emit (1), so that what its author made glow or unlit is on the display as bright as it was meant.
Sun default_sun() { return {glm::vec3(0.3f, -1.0f, 0.15f), glm::vec3(12.0f, 11.2f, 10.0f), 0.53f}; }
Sky default_sky() { return {glm::vec3(0.5f, 0.72f, 1.2f), glm::vec3(1.0f, 1.1f, 1.2f), glm::vec3(0.3f, 0.28f, 0.24f)}; }
/// Goes into the scene's hash where they may be used: light that was stored under others is not taken up.
constexpr std::uint32_t kDefaultLightVersion = 2;

std::uint32_t add_object(Scene& scene, std::string name) {
  scene.objects.push_back({std::move(name), false});
  return static_cast<std::uint32_t>(scene.objects.size() - 1);
}

void add_sun(Scene& scene, const Sun& sun) {
  Light light;
  light.kind = LightKind::kDirectional;
  light.direction = glm::normalize(sun.direction);
  light.intensity = sun.irradiance;
  light.angular_diameter = sun.angular_diameter_degrees * std::numbers::pi_v<float> / 180.0f;
  light.object = add_object(scene, "sun");
  scene.lights.push_back(light);
}

// Some surface lights the others. glTF's own range of emission ends at 1, white on a display, and is for screens, dials
// and signs; a lamp says more, by KHR_materials_emissive_strength.
bool has_lamp_surface(const Scene& scene) {
  return std::ranges::any_of(scene.instances, [&](const Instance& i) {
    const Material& m = scene.materials[scene.meshes[i.mesh].material];
    return !m.unlit && std::max({m.emissive.x, m.emissive.y, m.emissive.z}) > 1.0f;
  });
}

bool reflects_light(const Scene& scene) {
  return std::ranges::any_of(scene.instances,
                             [&](const Instance& i) { return !scene.materials[scene.meshes[i.mesh].material].unlit; });
}

Result<void> check_light(const Light& light, std::size_t index) {
  const std::string name = "extra light " + std::to_string(index);
  if (!is_radiance(light.intensity)) return fail(name + ": intensity must be finite and not negative");
  if (!std::isfinite(glm::dot(light.position, light.position))) return fail(name + ": position must be finite");
  if (light.kind != LightKind::kPoint && !is_direction(light.direction))
    return fail(name + ": direction must not be zero");
  if (!(light.range >= 0.0f) || !(light.angular_diameter >= 0.0f) || !(light.cos_inner >= light.cos_outer))
    return fail(name + ": range, angular diameter and cone must be in their range");
  return {};
}

class Hasher {
 public:
  explicit Hasher(std::uint64_t seed) : hash_(seed) {}
  template <class T>
  void add(const T& value) {
    static_assert(std::is_arithmetic_v<T>);
    hash_ = XXH3_64bits_withSeed(&value, sizeof value, hash_);
  }
  void add(const glm::vec3& v) {
    for (int c = 0; c < 3; ++c) add(v[c]);
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_;
};

}  // namespace

Result<void> check_setup(const LightSetup& setup) {
  if (setup.sun) {
    if (!is_direction(setup.sun->direction)) return fail("sun: direction must be finite and not zero");
    if (!is_radiance(setup.sun->irradiance)) return fail("sun: irradiance must be finite and not negative");
    if (!(setup.sun->angular_diameter_degrees >= 0.0f && setup.sun->angular_diameter_degrees <= kMaxSunDegrees))
      return fail("sun: angular diameter must be 0 to 90 degrees");
  }
  if (setup.sky &&
      !(is_radiance(setup.sky->zenith) && is_radiance(setup.sky->horizon) && is_radiance(setup.sky->ground)))
    return fail("sky: radiance must be finite and not negative");
  for (std::size_t i = 0; i < setup.extra_lights.size(); ++i)
    if (auto ok = check_light(setup.extra_lights[i], i); !ok) return ok;
  return {};
}

void apply_setup(Scene& scene, const LightSetup& setup) {
  if (setup.empty() && scene.lights.empty() && !has_lamp_surface(scene) && reflects_light(scene)) {
    add_sun(scene, default_sun());
    scene.sky = default_sky();
    return;
  }
  if (!setup.keep_file_lights) scene.lights.clear();
  if (setup.sun) add_sun(scene, *setup.sun);
  if (setup.sky) scene.sky = *setup.sky;
  for (std::size_t i = 0; i < setup.extra_lights.size(); ++i) {
    Light light = setup.extra_lights[i];
    light.position = glm::vec3(glm::dvec3(light.position) - scene.origin);
    if (light.kind != LightKind::kPoint) light.direction = glm::normalize(light.direction);
    light.object = add_object(scene, "extra light " + std::to_string(i));
    scene.lights.push_back(light);
  }
}

std::uint64_t hash_setup(const LightSetup& setup, std::uint64_t seed) {
  Hasher hash(seed);
  hash.add(setup.keep_file_lights);
  if (setup.empty()) hash.add(kDefaultLightVersion);
  hash.add(setup.sun.has_value());
  if (setup.sun) {
    hash.add(setup.sun->direction);
    hash.add(setup.sun->irradiance);
    hash.add(setup.sun->angular_diameter_degrees);
  }
  hash.add(setup.sky.has_value());
  if (setup.sky) {
    hash.add(setup.sky->zenith);
    hash.add(setup.sky->horizon);
    hash.add(setup.sky->ground);
  }
  for (const Light& l : setup.extra_lights) {
    hash.add(static_cast<std::uint32_t>(l.kind));
    hash.add(l.position);
    hash.add(l.direction);
    hash.add(l.intensity);
    for (const float f : {l.range, l.cos_inner, l.cos_outer, l.angular_diameter}) hash.add(f);
  }
  return hash.value();
}

}  // namespace darm::scene
