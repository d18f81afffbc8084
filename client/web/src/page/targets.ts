// What is drawn into before it reaches the screen: samples in linear light where half floats can be drawn.
import type {Gl} from './gl_resources.js';
import {makeTexture} from './gl_resources.js';
import type {Quality} from './quality.js';

export class Target {
  readonly width: number;
  readonly height: number;
  readonly texture: WebGLTexture;
  private readonly draw: WebGLFramebuffer;
  private readonly read: WebGLFramebuffer | null;
  private readonly buffers: WebGLRenderbuffer[] = [];

  /** `width` x `height` pixels; `quality.samples` squared of them lie in one of the picture. */
  constructor(private readonly gl: Gl, width: number, height: number, linear: boolean, readonly multisample: number) {
    this.width = width;
    this.height = height;
    const format = linear ? gl.RGBA16F : gl.RGBA8;
    this.texture = makeTexture(gl, format, width, height, gl.LINEAR);
    const draw = gl.createFramebuffer();
    this.draw = draw;
    gl.bindFramebuffer(gl.FRAMEBUFFER, draw);
    if (multisample > 0) {
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, this.buffer(format));
    } else {
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.texture, 0);
    }
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.buffer(gl.DEPTH_COMPONENT32F));
    const complete = gl.checkFramebufferStatus(gl.FRAMEBUFFER) === gl.FRAMEBUFFER_COMPLETE;
    this.read = multisample > 0 ? gl.createFramebuffer() : null;
    if (this.read !== null) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.read);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.texture, 0);
    }
    if (!complete && !gl.isContextLost()) throw new Error(`the graphics driver has no target of ${width}x${height}`);
  }

  bind(): void {
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, this.draw);
    this.gl.viewport(0, 0, this.width, this.height);
  }

  /** Once all is drawn: what `texture` shows is complete. */
  finish(): void {
    if (this.read === null) return;
    const gl = this.gl;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.draw);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.read);
    gl.blitFramebuffer(0, 0, this.width, this.height, 0, 0, this.width, this.height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
  }

  dispose(): void {
    this.gl.deleteTexture(this.texture);
    this.gl.deleteFramebuffer(this.draw);
    this.gl.deleteFramebuffer(this.read);
    for (const buffer of this.buffers) this.gl.deleteRenderbuffer(buffer);
  }

  private buffer(format: number): WebGLRenderbuffer {
    const gl = this.gl;
    const buffer = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
    gl.renderbufferStorageMultisample(gl.RENDERBUFFER, this.multisample, format, this.width, this.height);
    this.buffers.push(buffer);
    return buffer;
  }
}

/** The targets of the qualities in use; the two last used are kept (one for moving, one for stills). */
export class Targets {
  private kept: Target[] = [];

  private readonly mostSamples: number;

  constructor(private readonly gl: Gl, private readonly linear: boolean) {
    const samples = (format: number): number =>
      Math.max(0, ...(gl.getInternalformatParameter(gl.RENDERBUFFER, format, gl.SAMPLES) as Int32Array | null ?? []));
    this.mostSamples = Math.min(samples(linear ? gl.RGBA16F : gl.RGBA8), samples(gl.DEPTH_COMPONENT32F));
  }

  of(quality: Quality, width: number, height: number): Target {
    const largest = this.gl.getParameter(this.gl.MAX_RENDERBUFFER_SIZE) as number;
    const side = (pixels: number): number =>
      Math.max(1, Math.min(largest, Math.round(pixels * quality.scale))) * quality.samples;
    const w = Math.min(side(width), largest);
    const h = Math.min(side(height), largest);
    const multisample = Math.min(quality.multisample, this.mostSamples);
    const found = this.kept.findIndex((t) => t.width === w && t.height === h && t.multisample === multisample);
    const target = found >= 0 ? this.kept.splice(found, 1)[0]!
                              : new Target(this.gl, w, h, this.linear, multisample);
    this.kept.unshift(target);
    while (this.kept.length > 2) this.kept.pop()!.dispose();
    return target;
  }
}
