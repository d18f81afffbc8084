// Reading a material's textures at a point of a triangle. Called in the tracer's inner loop: no allocation, no locks.
#pragma once

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

/// Asks the processor for the texels that a full look at `material` (normal, base colour, metallic-roughness) will read
/// at the point, so that their way from memory overlaps. Changes nothing else.
void prefetch(const Scene& scene, const Material& material, const Mesh& mesh, std::uint32_t triangle, float u, float v);

/// `sample_at` the texture coordinate of a point of a triangle of `mesh`.
[[nodiscard]] glm::vec4 sample(const Scene& scene, const TextureRef& texture, const Mesh& mesh, std::uint32_t triangle,
                               float u, float v, TextureEncoding encoding);

}  // namespace darm::scene
