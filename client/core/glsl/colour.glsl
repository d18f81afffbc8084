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
