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
