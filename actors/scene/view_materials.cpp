#include "actors/scene/view_materials.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>

namespace darm::scene {
namespace {

constexpr float kRough = 0.6f;  // from here on a dielectric's coat shows no more than a brightness
constexpr std::uint32_t kGrid = 32;
constexpr float kSharpest = 0.1f;  // share of the points whose roughness decides

float linear(float code) { return code <= 0.04045f ? code / 12.92f : std::pow((code + 0.055f) / 1.055f, 2.4f); }
float srgb(float x) { return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f; }

// Texel of an image at grid point (x, y); white without one. Raw bytes: nobody sees a curve in an estimate.
glm::vec4 texel(const Scene& scene, const TextureRef& texture, std::uint32_t x, std::uint32_t y) {
  if (!texture.present() || static_cast<std::size_t>(texture.image) >= scene.images.size()) return glm::vec4(1.0f);
  const auto& image = scene.images[static_cast<std::size_t>(texture.image)];
  const std::size_t at = std::size_t{y * image.height / kGrid} * image.width + x * image.width / kGrid;
  if (at * 4 + 3 >= image.pixels.size()) return glm::vec4(1.0f);
  const auto* p = image.pixels.data() + at * 4;
  return glm::vec4(p[0], p[1], p[2], p[3]) * (1.0f / 255.0f);
}

struct Point {
  float weight = 0;
  float omitted = 0;
  float diffuse = 0;
  float call = 0;
  float roughness = 1;
};

Point point_of(const Scene& scene, const Material& m, std::uint32_t x, std::uint32_t y) {
  const glm::vec4 shine = texel(scene, m.metallic_roughness_texture, x, y);
  const glm::vec4 tint = texel(scene, m.base_color_texture, x, y);
  const float roughness = m.roughness * shine.y;
  const float metallic = m.metallic * shine.z;
  const float transmission = m.transmission * texel(scene, m.transmission_texture, x, y).x;
  const auto channel = [&](float factor, float code) { return factor * code * code; };
  const float base = 0.2126f * channel(m.base_color.x, tint.x) + 0.7152f * channel(m.base_color.y, tint.y) +
                     0.0722f * channel(m.base_color.z, tint.z);
  const float ratio = (m.ior - 1.0f) / (m.ior + 1.0f);
  const float f0 = ratio * ratio;
  const float fresnel = f0 > 0 ? f0 + (1.0f - f0) / 21.0f : 0.0f;  // its view average
  const float dielectric = 1.0f - metallic;
  const float diffuse = base * dielectric * (1.0f - transmission) * (1.0f - fresnel);
  const bool scatters = m.thickness > 0 || roughness * roughness > 1e-3f;  // else what is behind is drawn by the client
  const float through = scatters ? base * dielectric * transmission * (1.0f - fresnel) : 0.0f;
  const float needed = metallic * base + through + (roughness < kRough ? dielectric * fresnel : 0.0f);
  const float view = metallic * base + dielectric * fresnel + through;
  const float smooth = std::clamp(1.0f - roughness, 0.0f, 1.0f);
  const float contrast = 1.0f + 2.0f * smooth * smooth;
  constexpr float kGrey = kGreySurroundings;
  const auto shown = [&](float light) { return srgb(kGrey * (diffuse + light)) - srgb(kGrey * diffuse); };
  return {contrast * shown(view), shown(view), diffuse, contrast * shown(needed), roughness};
}

// A lobe of roughness r is about r^2 radians wide, and what it reflects changes over about so many pixels.
std::uint8_t levels_coarser(float roughness) {
  const float width = roughness * roughness;
  if (width < 0.12f) return 0;
  return width < 0.25f ? 1 : width < 0.4f ? 2 : 3;
}

}  // namespace

ViewMaterial view_material(const Scene& scene, const Material& m) {
  ViewMaterial out;
  if (m.unlit) return out;
  const bool textured =
      m.metallic_roughness_texture.present() || m.base_color_texture.present() || m.transmission_texture.present();
  const std::uint32_t grid = textured ? kGrid : 1;
  std::vector<float> roughness;
  double squares = 0;
  double calls = 0;
  double omitted = 0;
  double diffuse = 0;
  for (std::uint32_t y = 0; y < grid; ++y)
    for (std::uint32_t x = 0; x < grid; ++x) {
      const Point p = point_of(scene, m, x, y);
      squares += double{p.weight} * p.weight;
      calls += double{p.call} * p.call;
      omitted += double{p.omitted} * p.omitted;
      diffuse += double{p.diffuse};
      roughness.push_back(p.roughness);
    }
  const auto points = static_cast<double>(roughness.size());
  out.omitted = std::min(1.0f, static_cast<float>(std::sqrt(omitted / points)));
  out.weight = std::min(1.0f, static_cast<float>(std::sqrt(squares / points)));
  out.diffuse = static_cast<float>(diffuse / points);
  out.call = std::min(1.0f, static_cast<float>(std::sqrt(calls / points)));
  const auto sharp = roughness.begin() + static_cast<std::ptrdiff_t>(kSharpest * static_cast<float>(roughness.size()));
  std::nth_element(roughness.begin(), sharp, roughness.end());
  out.coarser = levels_coarser(*sharp);
  // A bent normal turns the lobe, and the base colour of metal is in its light: both have detail of their own.
  const bool detailed = m.normal_texture.present() || (m.metallic > 0 && m.base_color_texture.present());
  if (detailed && out.coarser > 0) --out.coarser;
  return out;
}

glm::vec3 mean_passage(const Scene& scene, const Material& m) {
  if (!(m.transmission > 0) || m.thickness > 0) return glm::vec3(0.0f);
  glm::vec3 sum(0.0f);
  for (std::uint32_t y = 0; y < kGrid; ++y)
    for (std::uint32_t x = 0; x < kGrid; ++x) {
      const glm::vec4 tint = texel(scene, m.base_color_texture, x, y);
      const float clear = m.transmission * texel(scene, m.transmission_texture, x, y).x *
                          (1.0f - m.metallic * texel(scene, m.metallic_roughness_texture, x, y).z);
      for (int c = 0; c < 3; ++c) sum[c] += m.base_color[c] * linear(tint[c]) * clear;
    }
  return glm::clamp(sum / static_cast<float>(kGrid * kGrid), 0.0f, 1.0f);
}

std::vector<ViewMaterial> view_materials(const Scene& scene, const ViewMaterialOptions& options) {
  std::vector<ViewMaterial> of_material;
  of_material.reserve(scene.materials.size());
  for (const auto& m : scene.materials) of_material.push_back(view_material(scene, m));
  std::vector<ViewMaterial> out;
  out.reserve(scene.instances.size());
  float most = 0;
  for (const auto& instance : scene.instances) {
    out.push_back(of_material[scene.meshes[instance.mesh].material]);
    most = std::max(most, out.back().call);
  }
  const float least = most >= options.calls ? options.joins : 2.0f;
  for (auto& m : out)
    if (m.weight < least) m = {.omitted = m.omitted, .diffuse = m.diffuse};
  return out;
}

bool calls_for_view_layer(const std::vector<ViewMaterial>& materials) {
  return std::any_of(materials.begin(), materials.end(), [](const ViewMaterial& m) { return m.weight > 0; });
}

}  // namespace darm::scene
