// Thin owners of WebGL 2 objects.

export type Gl = WebGL2RenderingContext;

/** A linked program; uniforms that it does not use are ignored when set. */
export class Program {
  private readonly program: WebGLProgram;
  private readonly places = new Map<string, WebGLUniformLocation | null>();

  constructor(private readonly gl: Gl, vertex: string, fragment: string) {
    this.program = gl.createProgram();
    const shaders = [compile(gl, gl.VERTEX_SHADER, vertex), compile(gl, gl.FRAGMENT_SHADER, fragment)];
    for (const shader of shaders) gl.attachShader(this.program, shader);
    gl.linkProgram(this.program);
    if (gl.getProgramParameter(this.program, gl.LINK_STATUS) !== true && !gl.isContextLost()) {
      const logs = [gl.getProgramInfoLog(this.program), ...shaders.map((shader) => gl.getShaderInfoLog(shader))];
      throw new Error(`the shaders do not build: ${logs.filter(Boolean).join('; ').slice(0, 500)}`);
    }
    for (const shader of shaders) gl.deleteShader(shader);
  }

  use(): void {
    this.gl.useProgram(this.program);
  }

  at(uniform: string): WebGLUniformLocation | null {
    let place = this.places.get(uniform);
    if (place === undefined) {
      place = this.gl.getUniformLocation(this.program, uniform);
      this.places.set(uniform, place);
    }
    return place;
  }
}

function compile(gl: Gl, stage: number, source: string): WebGLShader {
  const shader = gl.createShader(stage);
  if (shader === null) throw new Error('the graphics context is gone');
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  return shader;
}

/** Immutable 2D texture, clamped at its edges. Left bound. */
export function makeTexture(gl: Gl, format: number, width: number, height: number, filter: number): WebGLTexture {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  return texture;
}

/** Sets all channels of a texture that can be drawn into to `value`. What is bound to draw into is unbound. */
export function clearTexture(gl: Gl, texture: WebGLTexture, value: number): void {
  const frame = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  gl.clearBufferfv(gl.COLOR, 0, [value, value, value, value]);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.deleteFramebuffer(frame);
}

export function put(gl: Gl, texture: WebGLTexture, x: number, y: number, width: number, height: number, format: number,
                    type: number, data: ArrayBufferView): void {
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texSubImage2D(gl.TEXTURE_2D, 0, x, y, width, height, format, type, data);
}
