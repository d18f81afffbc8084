// Which share of the picture is drawn from what: counted on a small copy of it, read back without waiting.
import type {View} from './camera.js';
import type {Gl} from './gl_resources.js';
import type {Renderer} from './renderer.js';
import {Target} from './targets.js';

/** Shares of the samples that show a surface. */
export interface Residency {
  sharp: number;
  /** One to three levels coarser. */
  coarser: number;
  /** CoarseTex, though a finer level was asked for. */
  coarseTex: number;
  /** No light yet. */
  undefined: number;
}

const kCoarseness = 8;

/** Red values (class / 8 as a byte) to shares. */
export function residencyOf(rgba: Uint8Array): Residency {
  const counts = new Array<number>(9).fill(0);
  for (let i = 0; i < rgba.length; i += 4) ++counts[Math.min(8, Math.floor((rgba[i]! * 8 + 127) / 255))]!;
  const surfaces = Math.max(1, counts[0]! + counts[1]! + counts[2]! + counts[3]!);
  return {undefined: counts[0]! / surfaces, sharp: counts[1]! / surfaces, coarser: counts[2]! / surfaces,
    coarseTex: counts[3]! / surfaces};
}

export class ResidencyCounter {
  private target: Target | null = null;
  private pixels: WebGLBuffer | null = null;
  private fence: WebGLSync | null = null;

  constructor(private readonly gl: Gl) {}

  get busy(): boolean {
    return this.fence !== null;
  }

  start(renderer: Renderer, view: View, width: number, height: number): void {
    const gl = this.gl;
    const w = Math.max(1, Math.round(width / kCoarseness));
    const h = Math.max(1, Math.round(height / kCoarseness));
    if (this.target?.width !== w || this.target.height !== h) {
      this.target?.dispose();
      this.target = new Target(gl, w, h, false, 0);
    }
    this.target.bind();
    renderer.drawClasses(view, w, h, kCoarseness);
    this.pixels ??= gl.createBuffer();
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, this.pixels);
    gl.bufferData(gl.PIXEL_PACK_BUFFER, w * h * 4, gl.STREAM_READ);
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, 0);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  }

  /** The count, once the GPU is done with it. */
  take(): Residency | null {
    const gl = this.gl;
    if (this.fence === null || this.target === null) return null;
    if (gl.getSyncParameter(this.fence, gl.SYNC_STATUS) !== gl.SIGNALED) return null;
    gl.deleteSync(this.fence);
    this.fence = null;
    const rgba = new Uint8Array(this.target.width * this.target.height * 4);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, this.pixels);
    gl.getBufferSubData(gl.PIXEL_PACK_BUFFER, 0, rgba);
    gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
    return residencyOf(rgba);
  }
}
