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
  bool in_slot = false;
#ifndef COARSE
  for (int k = 0; k < 4; ++k) {
    int l = level + k;
    if (l >= u_level_count) break;
    if (!find_slot(u_pages, u_phys_size, patch_id, l, corner, at)) continue;
    light = slot_light(corner, at);
#if defined(MASK) || defined(BLEND)
    coverage = textureLod(u_coverage, (corner + at) / u_phys_size, 0.0).r;
#endif
    source = k == 0 ? 1.0 : 2.0;
    in_slot = true;
    break;
  }
#endif
  if (!in_slot && u_coarse_size.x > 0.0) {
    int last = u_level_count - 1;
    vec2 where = texel_of(patch_id, last) / u_coarse_size;
    light = to_rgb(textureLod(u_coarse_y, where, 0.0).r, textureLod(u_coarse_cb, where, 0.0).r,
                   textureLod(u_coarse_cr, where, 0.0).r);
    source = level == last ? 1.0 : 3.0;
  }
#if defined(MASK) || defined(BLEND)
  // No slot says it; before the first light either.
  if (!in_slot)
    coverage = textureLod(u_coarse_coverage,
                          texel_of(patch_id, u_level_count - 1) / vec2(textureSize(u_coarse_coverage, 0)), 0.0).r;
#endif
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
