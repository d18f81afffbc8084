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
