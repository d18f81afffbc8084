// Reading a material's textures at a point of a triangle. Called in the tracer's inner loop: no allocation, no locks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include "actors/scene/scene.hpp"

namespace darm::scene {

/// How the bytes of a texture encode light: colour textures (base colour, emissive) are sRGB, all others are linear.
/// Alpha is linear in both.
enum class TextureEncoding : std::uint8_t { kSrgb, kLinear };

/// Linear value in 0..1 of an sRGB byte (IEC 61966-2-1), from a table.
[[nodiscard]] float srgb_to_linear(std::uint8_t byte);

/// Texture coordinate of set `uv_set` at point (1 - u - v, u, v) of triangle `triangle`; (0, 0) if the mesh lacks the
/// set. `triangle` must be an index into mesh.triangles.
[[nodiscard]] glm::vec2 interpolate_uv(const Mesh& mesh, std::uint8_t uv_set, std::uint32_t triangle, float u, float v);

/// COLOR_0 (linear) at the point; (1, 1, 1, 1) if the mesh has none.
[[nodiscard]] glm::vec4 interpolate_color(const Mesh& mesh, std::uint32_t triangle, float u, float v);

/// Linear RGBA of `texture` at texture coordinate `uv`, before its KHR_texture_transform, which is applied here.
/// Bilinear in linear light (or nearest), wrap modes obeyed, texel centres at half integers. Any uv is safe: huge ones
/// are wrapped in double, non-finite ones read as 0. (1, 1, 1, 1) without a texture.
[[nodiscard]] glm::vec4 sample_at(const Scene& scene, const TextureRef& texture, glm::vec2 uv,
                                  TextureEncoding encoding);

/// Where a texture is read: byte offsets of four texels in its image, and how far the point lies between them.
struct Footprint {
  std::size_t upper_left, upper_right, lower_left, lower_right;
  float fx, fy;
};

/// The textures of a material that every hit reads, and which of them are read alike (same UV set, transform, wrapping,
/// filter and size), so that they share a footprint. Points into the scene it was made of.
struct TextureSet {
  enum Slot : std::uint8_t { kNormal, kBaseColor, kMetallicRoughness };
  static constexpr std::size_t kSlots = 3;
  struct Entry {
    const Image* image = nullptr;  ///< null: no texture, or one without an image
    const TextureRef* texture = nullptr;
    std::uint8_t like = 0;  ///< the first slot that is read at the same place; itself if none is
  };
  std::array<Entry, kSlots> entries;
  bool any = false;
};
[[nodiscard]] TextureSet texture_set(const Scene& scene, const Material& material);

/// What a hit reads of a TextureSet. Construction finds the places and asks the processor for them, so that their way
/// from memory overlaps with other work; reads come later. The set must outlive it.
class HitTextures {
 public:
  /// `triangle` must be an index into mesh.triangles.
  HitTextures(const TextureSet& set, const Mesh& mesh, std::uint32_t triangle, float u, float v) : set_(set) {
    if (set.any) find(mesh, triangle, u, v);
  }
  [[nodiscard]] bool has(TextureSet::Slot slot) const { return set_.entries[slot].image != nullptr; }
  /// Linear RGBA, as sample_at() gives it; (1, 1, 1, 1) without a texture.
  [[nodiscard]] glm::vec4 read(TextureSet::Slot slot, TextureEncoding encoding) const;

 private:
  void find(const Mesh& mesh, std::uint32_t triangle, float u, float v);

  const TextureSet& set_;
  std::array<Footprint, TextureSet::kSlots> places_;  // those that are `like` another stay unset
};

/// `sample_at` the texture coordinate of a point of a triangle of `mesh`.
[[nodiscard]] glm::vec4 sample(const Scene& scene, const TextureRef& texture, const Mesh& mesh, std::uint32_t triangle,
                               float u, float v, TextureEncoding encoding);

}  // namespace darm::scene
