#include "actors/scene/view_materials.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <tuple>

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

// What reaches an eye by a reflection, and through what scatters, as a share of what lights the picture: see
// ARCHITECTURE, decision 50.
constexpr float kByMetal = 0.6f;
constexpr float kThrough = 0.26f;
constexpr float kUnlike = 0.3f;  // what is reflected varies about its mean: its variance over the mean's square

using Omitted = decltype(ViewMaterial::omitted);

struct Point {
  float weight = 0;
  Omitted omitted{};
  float diffuse = 0;
  float call = 0;
  float roughness = 1;
};

// One point of a material, luminance; shares of the light that arrives.
struct Shares {
  float roughness = 1;
  float metal = 0;    // reflected by metal
  float coated = 1;   // of the surface that is no metal
  float f0 = 0;       // of the coat, straight on
  float diffuse = 0;  // what the shared light has
  float passed = 0;   // straight through what is thin: drawn by the client
  float through = 0;  // through what scatters or refracts
};

float fresnel_average(float f0) { return f0 > 0 ? f0 + (1.0f - f0) / 21.0f : 0.0f; }

Shares shares_of(const Scene& scene, const Material& m, std::uint32_t x, std::uint32_t y) {
  const glm::vec4 shine = texel(scene, m.metallic_roughness_texture, x, y);
  const glm::vec4 tint = texel(scene, m.base_color_texture, x, y);
  const float transmission = m.transmission * texel(scene, m.transmission_texture, x, y).x;
  const auto channel = [&](float factor, float code) { return factor * code * code; };
  const float base = 0.2126f * channel(m.base_color.x, tint.x) + 0.7152f * channel(m.base_color.y, tint.y) +
                     0.0722f * channel(m.base_color.z, tint.z);
  const float ratio = (m.ior - 1.0f) / (m.ior + 1.0f);
  const float metallic = m.metallic * shine.z;
  Shares out;
  out.roughness = m.roughness * shine.y;
  out.metal = metallic * base;
  out.coated = 1.0f - metallic;
  out.f0 = ratio * ratio;
  const float enters = base * out.coated * (1.0f - fresnel_average(out.f0));
  out.diffuse = enters * (1.0f - transmission);
  const bool thin = m.thickness <= 0;
  const bool scatters = !thin || out.roughness * out.roughness > 1e-3f;
  out.passed = thin ? enters * transmission : 0.0f;
  out.through = scatters ? enters * transmission : 0.0f;
  return out;
}

// Added to what reflects `light` of grey surroundings, as a difference of display values.
float shown(float added, float light) {
  return srgb(kGreySurroundings * (light + added)) - srgb(kGreySurroundings * light);
}

// GGX's directional albedo for Schlick's Fresnel: .025 RMS from the integral over roughness and angle for f0 = .04, .12
// at most, too little where what is nearly smooth is seen at its flattest.
float coat_albedo(float f0, float roughness, float rise) {
  const float smooth = 1.0f - roughness;
  return f0 > 0 ? f0 * (1.0f - 0.65f * roughness * roughness) + (0.06f + 0.85f * smooth * smooth) * rise : 0.0f;
}

float omitted_at(const Shares& p, float cosine) {
  const float grazing = 1.0f - cosine;
  const float rise = grazing * grazing * grazing * grazing * grazing;
  const float refracted = p.passed > 0 ? 0.0f : p.through;
  const float light = p.diffuse + p.passed;
  const float coat = p.coated * coat_albedo(p.f0, p.roughness, rise);
  const float added = shown(kByMetal * p.metal + coat + kThrough * refracted, light);
  // A coat lets in what it does not reflect straight back: a rough one darkens what is seen at a grazing angle.
  const float let_in = p.f0 > 0 ? (1.0f - rise) * (21.0f / 20.0f) : 1.0f;  // 1 - Fresnel over 1 - its average
  const float sum = added + shown(p.diffuse * (let_in - 1.0f), light);
  return sum * sum + kUnlike * added * added;
}

Point point_of(const Scene& scene, const Material& m, std::uint32_t x, std::uint32_t y) {
  const Shares p = shares_of(scene, m, x, y);
  const float fresnel = p.coated * fresnel_average(p.f0);
  const float smooth = std::clamp(1.0f - p.roughness, 0.0f, 1.0f);
  const float contrast = 1.0f + 2.0f * smooth * smooth;
  const float needed = p.metal + p.through + (p.roughness < kRough ? fresnel : 0.0f);
  Point out{contrast * shown(p.metal + fresnel + p.through, p.diffuse),
            {},
            p.diffuse,
            contrast * shown(needed, p.diffuse),
            p.roughness};
  for (std::size_t i = 0; i < out.omitted.size(); ++i)
    out.omitted[i] = omitted_at(p, (static_cast<float>(i) + 0.5f) / static_cast<float>(out.omitted.size()));
  return out;
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
  std::array<double, std::tuple_size_v<Omitted>> omitted{};
  double diffuse = 0;
  for (std::uint32_t y = 0; y < grid; ++y)
    for (std::uint32_t x = 0; x < grid; ++x) {
      const Point p = point_of(scene, m, x, y);
      squares += double{p.weight} * p.weight;
      calls += double{p.call} * p.call;
      for (std::size_t i = 0; i < omitted.size(); ++i) omitted[i] += double{p.omitted[i]};
      diffuse += double{p.diffuse};
      roughness.push_back(p.roughness);
    }
  const auto points = static_cast<double>(roughness.size());
  for (std::size_t i = 0; i < omitted.size(); ++i)
    out.omitted[i] = static_cast<float>(std::min(1.0, omitted[i] / points));
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
    if (m.weight < least) m = {.diffuse = m.diffuse, .omitted = m.omitted};
  return out;
}

bool calls_for_view_layer(const std::vector<ViewMaterial>& materials) {
  return std::any_of(materials.begin(), materials.end(), [](const ViewMaterial& m) { return m.weight > 0; });
}

}  // namespace darm::scene
