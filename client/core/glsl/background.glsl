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
