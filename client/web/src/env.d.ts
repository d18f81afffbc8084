// Shader texts come as strings (tools/build.mjs).
declare module '*.glsl' {
  const text: string;
  export default text;
}
