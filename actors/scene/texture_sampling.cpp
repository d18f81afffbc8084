#include "actors/scene/texture_sampling.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace darm::scene {
namespace {

constexpr std::size_t kStaysInCache = 64u << 10;  // bytes; smaller images need no prefetch

std::array<float, 256> make_srgb_table() {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double s = static_cast<double>(i) / 255.0;
    table[i] = static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
  }
  return table;
}

std::array<float, 256> make_linear_table() {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) table[i] = static_cast<float>(i) / 255.0f;
  return table;
}

const std::array<float, 256> kSrgbTable = make_srgb_table();
const std::array<float, 256> kLinearTable = make_linear_table();

/// Index of a texel after wrapping; `i` is at most a period outside [0, size).
std::uint32_t wrapped(std::int64_t i, std::int64_t size, Wrap wrap) {
  switch (wrap) {
    case Wrap::kClampToEdge:
      return static_cast<std::uint32_t>(std::clamp<std::int64_t>(i, 0, size - 1));
    case Wrap::kMirroredRepeat: {
      const std::int64_t period = 2 * size;
      const std::int64_t m = ((i % period) + period) % period;
      return static_cast<std::uint32_t>(m < size ? m : period - 1 - m);
    }
    case Wrap::kRepeat:
      break;
  }
  if (i < 0) return static_cast<std::uint32_t>(i + size);
  return static_cast<std::uint32_t>(i >= size ? i - size : i);
}

/// Brings a coordinate into one period ([0, 1) or [0, 2) mirrored) or, clamped, into [-1, 2], so that texel indices
/// stay small.
double reduced(float coordinate, Wrap wrap) {
  const double c = static_cast<double>(coordinate);
  if (!std::isfinite(c)) return 0.0;
  switch (wrap) {
    case Wrap::kClampToEdge:
      return std::clamp(c, -1.0, 2.0);
    case Wrap::kMirroredRepeat:
      return c - 2.0 * std::floor(c * 0.5);
    case Wrap::kRepeat:
      break;
  }
  return c - std::floor(c);
}

/// `image` must have pixels.
Footprint locate(const Image& image, const TextureRef& texture, const glm::vec2& uv) {
  const glm::mat3& t = texture.uv_transform;
  double x = reduced(t[0][0] * uv.x + t[1][0] * uv.y + t[2][0], texture.wrap_s) * image.width;
  double y = reduced(t[0][1] * uv.x + t[1][1] * uv.y + t[2][1], texture.wrap_t) * image.height;
  if (!texture.nearest) {
    x -= 0.5;
    y -= 0.5;
  }
  const double left = std::floor(x);
  const double top = std::floor(y);
  const std::int64_t step = texture.nearest ? 0 : 1;
  const auto ix = static_cast<std::int64_t>(left);
  const auto iy = static_cast<std::int64_t>(top);
  const std::size_t x0 = wrapped(ix, image.width, texture.wrap_s);
  const std::size_t x1 = wrapped(ix + step, image.width, texture.wrap_s);
  const std::size_t row0 = std::size_t{wrapped(iy, image.height, texture.wrap_t)} * image.width;
  const std::size_t row1 = std::size_t{wrapped(iy + step, image.height, texture.wrap_t)} * image.width;
  return {(row0 + x0) * 4,
          (row0 + x1) * 4,
          (row1 + x0) * 4,
          (row1 + x1) * 4,
          texture.nearest ? 0.0f : static_cast<float>(x - left),
          texture.nearest ? 0.0f : static_cast<float>(y - top)};
}

glm::vec4 mix(const Image& image, const Footprint& f, TextureEncoding encoding) {
  const auto& color = encoding == TextureEncoding::kSrgb ? kSrgbTable : kLinearTable;
  const float w11 = f.fx * f.fy;
  const float w10 = f.fx - w11;
  const float w01 = f.fy - w11;
  const float w00 = 1.0f - f.fx - w01;
  const std::uint8_t* pixels = image.pixels.data();
  const auto mixed = [&](std::size_t channel, const std::array<float, 256>& table) {
    return table[pixels[f.upper_left + channel]] * w00 + table[pixels[f.upper_right + channel]] * w10 +
           table[pixels[f.lower_left + channel]] * w01 + table[pixels[f.lower_right + channel]] * w11;
  };
  return {mixed(0, color), mixed(1, color), mixed(2, color), mixed(3, kLinearTable)};
}

bool read_alike(const TextureSet::Entry& a, const TextureSet::Entry& b) {
  return a.texture->uv_set == b.texture->uv_set && a.texture->wrap_s == b.texture->wrap_s &&
         a.texture->wrap_t == b.texture->wrap_t && a.texture->nearest == b.texture->nearest &&
         a.texture->uv_transform == b.texture->uv_transform && a.image->width == b.image->width &&
         a.image->height == b.image->height;
}

/// The image of a texture, or null if it has none or an empty one.
const Image* image_of(const Scene& scene, const TextureRef& texture) {
  if (!texture.present() || static_cast<std::size_t>(texture.image) >= scene.images.size()) return nullptr;
  const Image& image = scene.images[static_cast<std::size_t>(texture.image)];
  return image.width == 0 || image.height == 0 ? nullptr : &image;
}

}  // namespace

float srgb_to_linear(std::uint8_t byte) { return kSrgbTable[byte]; }

glm::vec2 interpolate_uv(const Mesh& mesh, std::uint8_t uv_set, std::uint32_t triangle, float u, float v) {
  const auto& uvs = mesh.uvs[uv_set < 2 ? uv_set : 0];
  if (uvs.empty()) return glm::vec2(0.0f);
  const glm::uvec3 t = mesh.triangles[triangle];
  return uvs[t.x] * (1.0f - u - v) + uvs[t.y] * u + uvs[t.z] * v;
}

glm::vec4 interpolate_color(const Mesh& mesh, std::uint32_t triangle, float u, float v) {
  if (mesh.colors.empty()) return glm::vec4(1.0f);
  const glm::uvec3 t = mesh.triangles[triangle];
  return mesh.colors[t.x] * (1.0f - u - v) + mesh.colors[t.y] * u + mesh.colors[t.z] * v;
}

glm::vec4 sample_at(const Scene& scene, const TextureRef& texture, glm::vec2 uv, TextureEncoding encoding) {
  const Image* image = image_of(scene, texture);
  if (image == nullptr) return glm::vec4(1.0f);
  return mix(*image, locate(*image, texture, uv), encoding);
}

TextureSet texture_set(const Scene& scene, const Material& material) {
  TextureSet set;
  const std::array<const TextureRef*, TextureSet::kSlots> textures = {
      &material.normal_texture, &material.base_color_texture, &material.metallic_roughness_texture};
  for (std::size_t slot = 0; slot < textures.size(); ++slot) {
    auto& entry = set.entries[slot];
    entry = {image_of(scene, *textures[slot]), textures[slot], static_cast<std::uint8_t>(slot)};
    if (entry.image == nullptr) continue;
    set.any = true;
    for (std::size_t other = 0; other < slot; ++other) {
      if (set.entries[other].image == nullptr || !read_alike(set.entries[other], entry)) continue;
      entry.like = set.entries[other].like;
      break;
    }
  }
  return set;
}

void HitTextures::find(const Mesh& mesh, std::uint32_t triangle, float u, float v) {
  int held = -1;
  glm::vec2 uv(0.0f);
  for (std::size_t slot = 0; slot < TextureSet::kSlots; ++slot) {
    const auto& entry = set_.entries[slot];
    if (entry.image == nullptr) continue;
    if (entry.like == slot) {
      if (entry.texture->uv_set != held) {
        held = entry.texture->uv_set;
        uv = interpolate_uv(mesh, entry.texture->uv_set, triangle, u, v);
      }
      places_[slot] = locate(*entry.image, *entry.texture, uv);
    }
    if (entry.image->pixels.size() < kStaysInCache) continue;
    const Footprint& place = places_[entry.like];
    __builtin_prefetch(entry.image->pixels.data() + place.upper_left);
    __builtin_prefetch(entry.image->pixels.data() + place.lower_left);
  }
}

glm::vec4 HitTextures::read(TextureSet::Slot slot, TextureEncoding encoding) const {
  const auto& entry = set_.entries[slot];
  return entry.image == nullptr ? glm::vec4(1.0f) : mix(*entry.image, places_[entry.like], encoding);
}

glm::vec4 sample(const Scene& scene, const TextureRef& texture, const Mesh& mesh, std::uint32_t triangle, float u,
                 float v, TextureEncoding encoding) {
  if (!texture.present()) return glm::vec4(1.0f);
  return sample_at(scene, texture, interpolate_uv(mesh, texture.uv_set, triangle, u, v), encoding);
}

}  // namespace darm::scene
