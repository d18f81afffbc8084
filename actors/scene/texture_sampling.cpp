#include "actors/scene/texture_sampling.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace darm::scene {
namespace {

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

struct Decoder {
  const Image& image;
  const std::array<float, 256>& color;

  [[nodiscard]] glm::vec4 at(std::uint32_t x, std::uint32_t y) const {
    const std::uint8_t* p = image.pixels.data() + (static_cast<std::size_t>(y) * image.width + x) * 4;
    return {color[p[0]], color[p[1]], color[p[2]], kLinearTable[p[3]]};
  }
};

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
  if (!texture.present() || static_cast<std::size_t>(texture.image) >= scene.images.size()) return glm::vec4(1.0f);
  const Image& image = scene.images[static_cast<std::size_t>(texture.image)];
  if (image.width == 0 || image.height == 0) return glm::vec4(1.0f);
  const glm::vec3 moved = texture.uv_transform * glm::vec3(uv, 1.0f);
  const Decoder texels{image, encoding == TextureEncoding::kSrgb ? kSrgbTable : kLinearTable};
  const double x = reduced(moved.x, texture.wrap_s) * image.width;
  const double y = reduced(moved.y, texture.wrap_t) * image.height;
  const std::int64_t width = image.width;
  const std::int64_t height = image.height;
  if (texture.nearest) {
    return texels.at(wrapped(static_cast<std::int64_t>(std::floor(x)), width, texture.wrap_s),
                     wrapped(static_cast<std::int64_t>(std::floor(y)), height, texture.wrap_t));
  }
  const double left = std::floor(x - 0.5);
  const double top = std::floor(y - 0.5);
  const auto fx = static_cast<float>(x - 0.5 - left);
  const auto fy = static_cast<float>(y - 0.5 - top);
  const auto ix = static_cast<std::int64_t>(left);
  const auto iy = static_cast<std::int64_t>(top);
  const std::uint32_t x0 = wrapped(ix, width, texture.wrap_s);
  const std::uint32_t x1 = wrapped(ix + 1, width, texture.wrap_s);
  const std::uint32_t y0 = wrapped(iy, height, texture.wrap_t);
  const std::uint32_t y1 = wrapped(iy + 1, height, texture.wrap_t);
  const glm::vec4 upper = texels.at(x0, y0) * (1.0f - fx) + texels.at(x1, y0) * fx;
  const glm::vec4 lower = texels.at(x0, y1) * (1.0f - fx) + texels.at(x1, y1) * fx;
  return upper * (1.0f - fy) + lower * fy;
}

glm::vec4 sample(const Scene& scene, const TextureRef& texture, const Mesh& mesh, std::uint32_t triangle, float u,
                 float v, TextureEncoding encoding) {
  if (!texture.present()) return glm::vec4(1.0f);
  return sample_at(scene, texture, interpolate_uv(mesh, texture.uv_set, triangle, u, v), encoding);
}

}  // namespace darm::scene
