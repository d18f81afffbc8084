// The immutable scene every other room reads. Made once by gltf_loader; never changed, shared by shared_ptr<const
// Scene>.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "actors/types/camera.hpp"

namespace darm::scene {

/// 8-bit image, RGBA, row-major, top row first. `width * height * 4 == pixels.size()`.
struct Image {
  std::string name;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> pixels;
};

enum class Wrap : std::uint8_t { kRepeat, kMirroredRepeat, kClampToEdge };

/// A texture as a material uses it: image, sampler, UV set and KHR_texture_transform.
struct TextureRef {
  std::int32_t image = -1;  ///< index into Scene::images; -1: no texture
  std::uint8_t uv_set = 0;  ///< 0 or 1
  Wrap wrap_s = Wrap::kRepeat;
  Wrap wrap_t = Wrap::kRepeat;
  bool nearest = false;          ///< magnification filter NEAREST
  glm::mat3 uv_transform{1.0f};  ///< applied to (u, v, 1)
  [[nodiscard]] bool present() const { return image >= 0; }
};

enum class AlphaMode : std::uint8_t { kOpaque, kMask, kBlend };

/// glTF metallic-roughness material with the extensions of DESIGN section 4. Factors are linear; all finite and clamped
/// to their legal range by the loader.
struct Material {
  std::string name;
  glm::vec4 base_color{1.0f};
  TextureRef base_color_texture;  ///< sRGB
  float metallic = 1.0f;
  float roughness = 1.0f;
  TextureRef metallic_roughness_texture;  ///< linear; G roughness, B metallic
  TextureRef normal_texture;              ///< linear
  float normal_scale = 1.0f;
  glm::vec3 emissive{0.0f};     ///< emissiveFactor * emissiveStrength, nits (radiance)
  TextureRef emissive_texture;  ///< sRGB
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  float alpha_cutoff = 0.5f;
  bool double_sided = false;
  bool unlit = false;  ///< KHR_materials_unlit: base colour is the radiance, no light is reflected
  float ior = 1.5f;
  float transmission = 0.0f;        ///< KHR_materials_transmission
  TextureRef transmission_texture;  ///< linear; R
  float thickness = 0.0f;           ///< KHR_materials_volume; 0: thin-walled
  glm::vec3 attenuation_color{1.0f};
  float attenuation_distance = 0.0f;  ///< 0: no attenuation (glTF's infinity)
  [[nodiscard]] bool emits() const { return emissive.x > 0 || emissive.y > 0 || emissive.z > 0; }
};

/// One glTF triangle primitive in its node space. Strips and fans are turned into lists; zero-area and non-finite
/// triangles stay out (counted in Scene::dropped). All per-vertex arrays are empty or as long as `positions`.
struct Mesh {
  std::string name;
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;   ///< never empty: made flat from the faces where the file has none; unit length
  std::vector<glm::vec4> tangents;  ///< xyz unit, w = handedness; empty unless the material has a normal map
  std::array<std::vector<glm::vec2>, 2> uvs;
  std::vector<glm::vec4> colors;  ///< COLOR_0, linear
  std::vector<glm::uvec3> triangles;
  std::uint32_t material = 0;  ///< always valid: meshes without one get the default material
};

/// A mesh placed in the scene. `to_world` maps node space to recentred world space (Scene::origin subtracted in
/// double). A negative determinant flips winding: the front of a triangle is the side from which its *world-space*
/// vertices, taken in `Mesh::triangles` order, and then swapped when `flipped`, run counter-clockwise.
struct Instance {
  std::uint32_t mesh = 0;
  glm::mat4 to_world{1.0f};
  bool flipped = false;      ///< det(to_world) < 0
  std::uint32_t object = 0;  ///< index into Scene::objects (the node it came from)
};

/// A named node of the file that carries instances or lights.
struct Object {
  std::string name;
  bool dynamic = false;  ///< marked movable: `extras.darm_dynamic` is true on the node
};

enum class LightKind : std::uint8_t { kPoint, kSpot, kDirectional };

/// KHR_lights_punctual light, in recentred world space. `intensity` is colour * intensity: candela for point and spot,
/// lux for directional. `direction` is the way light travels, unit length.
struct Light {
  LightKind kind = LightKind::kPoint;
  glm::vec3 position{0.0f};
  glm::vec3 direction{0, 0, -1};
  glm::vec3 intensity{1.0f};
  float range = 0.0f;  ///< metres; 0: infinite
  float cos_inner = 1.0f;
  float cos_outer = 0.70710678f;
  float angular_diameter = 0.0f;  ///< radians; directional only: a disc sun (0: delta)
  std::uint32_t object = 0;
};

/// Radiance (nits) from directions that hit nothing: `horizon` at y = 0, `zenith` at y = 1, linear in y between;
/// `ground` below the horizon. Uniform if all are equal.
struct Sky {
  glm::vec3 zenith{0.0f};
  glm::vec3 horizon{0.0f};
  glm::vec3 ground{0.0f};
  [[nodiscard]] bool emits() const {
    return zenith.x + zenith.y + zenith.z + horizon.x + horizon.y + horizon.z + ground.x + ground.y + ground.z > 0;
  }
  /// Radiance along unit direction `d`.
  [[nodiscard]] glm::vec3 radiance(const glm::vec3& d) const {
    if (d.y < 0) return ground;
    return horizon + (zenith - horizon) * d.y;
  }
};

struct NamedCamera {
  std::string name;
  Camera camera;
};

/// A face or primitive that was left out, and why. Counted per reason, never silent.
struct Dropped {
  std::string reason;
  std::uint64_t triangles = 0;
};

struct Scene {
  std::string path;
  std::uint64_t hash = 0;      ///< of the file's bytes and everything it refers to, and of the lights and sky in force
  glm::dvec3 origin{0.0};      ///< world = file coordinates - origin
  glm::vec3 bounds_min{0.0f};  ///< recentred
  glm::vec3 bounds_max{0.0f};
  std::vector<Image> images;
  std::vector<Material> materials;
  std::vector<Mesh> meshes;
  std::vector<Instance> instances;
  std::vector<Object> objects;
  std::vector<Light> lights;
  Sky sky;
  std::vector<NamedCamera> cameras;   ///< glTF cameras
  std::vector<std::string> warnings;  ///< what is not supported and was left out, one line each
  std::vector<Dropped> dropped;
  /// Triangles over all instances.
  [[nodiscard]] std::uint64_t triangle_count() const {
    std::uint64_t n = 0;
    for (const auto& i : instances) n += meshes[i.mesh].triangles.size();
    return n;
  }
};

}  // namespace darm::scene
