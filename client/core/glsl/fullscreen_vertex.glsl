uniform float u_depth;  // of the far plane, where it matters
out vec2 v_ndc;
void main() {
  v_ndc = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(v_ndc, u_depth, 1.0);
}
