#include "client/core/shaders.hpp"

#include <algorithm>
#include <cmath>

namespace darm::client {
namespace {

constexpr const char* kHeader = R"(#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
)";

constexpr const char* kColour = R"(
vec3 to_linear(vec3 c) {
  return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, vec3(lessThanEqual(c, vec3(0.04045))));
}
vec3 to_srgb(vec3 c) {
  return mix(1.055 * pow(max(c, vec3(0.0)), vec3(1.0 / 2.4)) - 0.055, c * 12.92, vec3(lessThanEqual(c, vec3(0.0031308))));
}
// Full-range BT.709.
vec3 to_rgb(float y, float cb, float cr) {
  float b = cb - 128.0 / 255.0;
  float r = cr - 128.0 / 255.0;
  return clamp(vec3(y + 1.5748 * r, y - 0.187324 * b - 0.468124 * r, y + 1.8556 * b), 0.0, 1.0);
}
)";

constexpr const char* kSurfaceUniforms = R"(
in vec2 v_uv;
flat in uint v_patch;
uniform usampler2D u_places;   // x, y, bits of scale; level-major, 2048 wide
uniform usampler2D u_pages;    // slots of all tiles, 2048 wide
uniform vec4 u_levels[16];     // density, first tile, tiles_x, tiles_y
uniform int u_level_count;
uniform uint u_patch_count;
uniform uint u_front_base;
uniform uint u_back_base;      // 0xffffffff: none
uniform float u_q_per_pixel;   // q * samples per pixel on an axis
uniform float u_phys_size;     // pixels
uniform vec2 u_coarse_size;    // pixels; 0: none yet
uniform vec3 u_missing;        // colour where there is no light yet
uniform float u_cutoff;
#ifdef LOSSLESS
uniform sampler2D u_rgb;
#else
uniform sampler2D u_y;
uniform sampler2D u_cb;
uniform sampler2D u_cr;
uniform float u_chroma_step;   // 0.5: 4:2:0, 1: 4:4:4
#endif
#ifdef VIEW
uniform usampler2D u_view_pages;
uniform float u_view_size;     // pixels
#ifdef LOSSLESS
uniform sampler2D u_view_rgb;
#else
uniform sampler2D u_view_y;
uniform sampler2D u_view_cb;
uniform sampler2D u_view_cr;
uniform float u_view_chroma_step;
#endif
#endif
#ifdef VIEW
in vec3 v_from_eye;            // world axes
uniform float u_f0;            // 0: nothing is dimmed by Fresnel's term
#endif
#ifdef THROUGH
uniform sampler2D u_through;
uniform vec3 u_tint;           // passed where no private tile says better
#endif
uniform sampler2D u_coverage;
uniform sampler2D u_coarse_y;
uniform sampler2D u_coarse_cb;
uniform sampler2D u_coarse_cr;
out vec4 o_colour;
)";

constexpr const char* kSurfaceBody = R"(
int sharp_level(vec2 dx, vec2 dy) {
  float f = dot(dx, dx) + dot(dy, dy);
  float d = abs(dx.x * dy.y - dx.y * dy.x);
  float major = sqrt(0.5 * (f + sqrt(max(f * f - 4.0 * d * d, 0.0))));
  float minor = d / max(major, 1e-20);
  return clamp(int(floor(log2(max(minor, 1e-6)))), 0, u_level_count - 1);
}
uvec2 table(uint i) { return uvec2(i & 2047u, i >> 11); }

vec2 texel_of(uint patch_id, int level) {
  uint entry = uint(level) * u_patch_count + patch_id;
  uvec4 place = texelFetch(u_places, ivec2(table(entry)), 0);
  return vec2(place.xy) + 0.5 + v_uv * (uintBitsToFloat(place.z) * u_levels[level].x);
}

// Light at a texel of a resident slot. `at` is the position inside the slot, in [1, 31].
#ifndef LOSSLESS
vec3 planes_light(sampler2D y, sampler2D cb, sampler2D cr, float size, float step, vec2 corner, vec2 at) {
  float luma = textureLod(y, (corner + at) / size, 0.0).r;
  // Chroma is never sampled across a slot.
  vec2 c = clamp(at * step, vec2(0.5), vec2(32.0 * step - 0.5));
  vec2 where = (corner * step + c) / (size * step);
  return to_rgb(luma, textureLod(cb, where, 0.0).r, textureLod(cr, where, 0.0).r);
}
#endif
vec3 slot_light(vec2 corner, vec2 at) {
#ifdef LOSSLESS
  return textureLod(u_rgb, (corner + at) / u_phys_size, 0.0).rgb;
#else
  return planes_light(u_y, u_cb, u_cr, u_phys_size, u_chroma_step, corner, at);
#endif
}

// The slot that serves level `l`, or false. `corner`: its place; `at`: where the sample lies in it.
bool find_slot(usampler2D pages, float size, uint patch_id, int l, out vec2 corner, out vec2 at) {
  vec2 texel = texel_of(patch_id, l);
  vec2 tile = floor(texel / 30.0);
  vec4 shape = u_levels[l];
  if (any(lessThan(tile, vec2(0.0))) || any(greaterThanEqual(tile, shape.zw))) return false;
  uint entry = uint(shape.y) + uint(tile.y) * uint(shape.z) + uint(tile.x);
  uint slot = texelFetch(pages, ivec2(table(entry)), 0).r;
  if (slot == 65535u) return false;
  uint per_row = uint(size) / 32u;
  corner = vec2(slot % per_row, slot / per_row) * 32.0;
  at = texel - tile * 30.0 + 1.0;
  return true;
}

#ifdef VIEW
vec3 view_light(vec2 corner, vec2 at) {
#ifdef LOSSLESS
  return textureLod(u_view_rgb, (corner + at) / u_view_size, 0.0).rgb;
#else
  return planes_light(u_view_y, u_view_cb, u_view_cr, u_view_size, u_view_chroma_step, corner, at);
#endif
}
#endif

void main() {
  // Derivatives first, in uniform control flow, and of uv alone.
  vec2 dx = dFdx(v_uv) * u_q_per_pixel;
  vec2 dy = dFdy(v_uv) * u_q_per_pixel;
#ifdef VIEW
  // Fresnel's term by the facet: a client has no normals.
  float m = 1.0 - abs(dot(normalize(cross(dFdx(v_from_eye), dFdy(v_from_eye))), normalize(v_from_eye)));
  float m5 = m * m * m * m * m;
#endif
  int level = sharp_level(dx, dy);
  uint base = (gl_FrontFacing || u_back_base == 0xffffffffu) ? u_front_base : u_back_base;
  uint patch_id = min(base + v_patch, u_patch_count - 1u);

  vec3 light = u_missing;
  vec2 corner = vec2(0.0), at = vec2(0.0);
  float coverage = 1.0;
  float source = 0.0;
  for (int k = 0; k < 4; ++k) {
    int l = level + k;
    if (l >= u_level_count) break;
    if (!find_slot(u_pages, u_phys_size, patch_id, l, corner, at)) continue;
    light = slot_light(corner, at);
#if defined(MASK) || defined(BLEND)
    coverage = textureLod(u_coverage, (corner + at) / u_phys_size, 0.0).r;
#endif
    source = k == 0 ? 1.0 : 2.0;
    break;
  }
  if (source == 0.0 && u_coarse_size.x > 0.0) {
    int last = u_level_count - 1;
    vec2 where = texel_of(patch_id, last) / u_coarse_size;
    light = to_rgb(textureLod(u_coarse_y, where, 0.0).r, textureLod(u_coarse_cb, where, 0.0).r,
                   textureLod(u_coarse_cr, where, 0.0).r);
    source = level == last ? 1.0 : 3.0;
  }
#ifdef MASK
  if (coverage < u_cutoff) discard;
  coverage = 1.0;
#endif
#ifdef VIEW
  vec3 own = vec3(0.0);
  float factor = 1.0;
#ifdef THROUGH
  vec3 through = u_tint;
#endif
  for (int k = 0; k < 4; ++k) {
    int l = level + k;
    if (l >= u_level_count) break;
    if (!find_slot(u_view_pages, u_view_size, patch_id, l, corner, at)) continue;
#ifdef THROUGH
    through = to_linear(textureLod(u_through, (corner + at) / u_view_size, 0.0).rgb);
#else
    own = to_linear(view_light(corner, at));
    // Shared light has the mean over all eyes, 20 / 21 (1 - f0); this one has (1 - f0) (1 - m^5).
    if (u_f0 > 0.0) factor = 1.05 * (1.0 - m5);
#endif
    break;
  }
#endif
#ifdef STATS
  o_colour = vec4(source / 8.0, 0.0, 0.0, 1.0);
#elif defined(THROUGH)
  if (u_f0 > 0.0) through *= (1.0 - u_f0) * (1.0 - m5);
#ifdef BLEND
  through += 1.0 - coverage;
#endif
#ifdef LINEAR
  o_colour = vec4(through, 1.0);
#else
  o_colour = vec4(to_srgb(through), 1.0);
#endif
#else
#ifdef VIEW
  vec3 shared_light = to_linear(light);
  // What is as bright as the display can be was cut there, and how much is not known: it is taken for 1.4.
  float cut = min(1.4 * factor, max(factor, 1.0));
  shared_light *= mix(vec3(factor), vec3(cut), smoothstep(0.985, 1.0, shared_light));
  vec3 sum = min(shared_light + own, vec3(1.0));
#ifdef LINEAR
  o_colour = vec4(sum, coverage);
#else
  o_colour = vec4(to_srgb(sum), coverage);
#endif
#elif defined(LINEAR)
  o_colour = vec4(to_linear(light), coverage);
#else
  o_colour = vec4(light, coverage);
#endif
#endif
}
)";

}  // namespace

std::string surface_vertex_source(bool view) {
  return std::string(kHeader) + (view ? "#define VIEW\n" : "") + R"(
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec2 a_uv;
layout(location = 2) in uint a_patch;
uniform mat4 u_to_clip;
#ifdef VIEW
uniform mat4 u_from_eye;  // node space -> world axes, the eye at the origin
out vec3 v_from_eye;
#endif
out vec2 v_uv;
flat out uint v_patch;
invariant gl_Position;  // the depth pass must give the same depths
void main() {
  v_uv = a_uv;
  v_patch = a_patch;
#ifdef VIEW
  v_from_eye = (u_from_eye * vec4(a_position, 1.0)).xyz;
#endif
  gl_Position = u_to_clip * vec4(a_position, 1.0);
}
)";
}

std::string surface_fragment_source(const SurfaceVariant& variant) {
  std::string source = kHeader;
  if (variant.lossless) source += "#define LOSSLESS\n";
  if (variant.mask) source += "#define MASK\n";
  if (variant.blend) source += "#define BLEND\n";
  if (variant.linear) source += "#define LINEAR\n";
  if (variant.stats) source += "#define STATS\n";
  if (variant.view) source += "#define VIEW\n";
  if (variant.through) source += "#define THROUGH\n";
  return source + kSurfaceUniforms + kColour + kSurfaceBody;
}

std::string depth_fragment_source() { return std::string(kHeader) + "void main() {}\n"; }

std::string fullscreen_vertex_source() {
  return std::string(kHeader) + R"(
uniform float u_depth;  // of the far plane, where it matters
out vec2 v_ndc;
void main() {
  v_ndc = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(v_ndc, u_depth, 1.0);
}
)";
}

std::string background_fragment_source(bool linear, bool stats) {
  std::string source = kHeader;
  if (linear) source += "#define LINEAR\n";
  if (stats) source += "#define STATS\n";
  return source + kColour + R"(
in vec2 v_ndc;
uniform vec3 u_right;    // half the picture's width at distance 1
uniform vec3 u_up;
uniform vec3 u_forward;
uniform vec3 u_zenith;
uniform vec3 u_horizon;
uniform vec3 u_ground;
uniform vec4 u_sun;      // direction to the disc, cosine of its radius; > 1: none
uniform vec3 u_sun_rgb;
out vec4 o_colour;
void main() {
#ifdef STATS
  o_colour = vec4(4.0 / 8.0, 0.0, 0.0, 1.0);
#else
  vec3 d = normalize(u_forward + v_ndc.x * u_right + v_ndc.y * u_up);
  vec3 light = d.y < 0.0 ? u_ground : mix(u_horizon, u_zenith, d.y);
  if (dot(d, u_sun.xyz) >= u_sun.w) light += u_sun_rgb;
  light = clamp(light, 0.0, 1.0);
#ifdef LINEAR
  o_colour = vec4(light, 1.0);
#else
  o_colour = vec4(to_srgb(light), 1.0);
#endif
#endif
}
)";
}

std::string resolve_fragment_source(bool linear) {
  std::string source = kHeader;
  if (linear) source += "#define LINEAR\n";
  return source + kColour + R"(
uniform sampler2D u_samples;
out vec4 o_colour;
vec3 sample_at(ivec2 p) {
  vec3 c = clamp(texelFetch(u_samples, p, 0).rgb, 0.0, 1.0);
#ifdef LINEAR
  return c;
#else
  return to_linear(c);
#endif
}
void main() {
  ivec2 p = ivec2(gl_FragCoord.xy) * 2;
  vec3 sum = sample_at(p) + sample_at(p + ivec2(1, 0)) + sample_at(p + ivec2(0, 1)) + sample_at(p + ivec2(1, 1));
  o_colour = vec4(to_srgb(0.25 * sum), 1.0);
}
)";
}

int sharp_level(const float dx[2], const float dy[2], int levels) {
  const float f = dx[0] * dx[0] + dx[1] * dx[1] + dy[0] * dy[0] + dy[1] * dy[1];
  const float d = std::abs(dx[0] * dy[1] - dx[1] * dy[0]);
  const float major = std::sqrt(0.5f * (f + std::sqrt(std::max(f * f - 4.0f * d * d, 0.0f))));
  const float minor = d / std::max(major, 1e-20f);
  return std::clamp(static_cast<int>(std::floor(std::log2(std::max(minor, 1e-6f)))), 0, levels - 1);
}

}  // namespace darm::client
