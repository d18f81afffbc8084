// How long pictures take, until the GPU is done with them; and that no second one is begun before.
import type {Gl} from './gl_resources.js';
import type {Quality} from './quality.js';

export class DrawTimer {
  lastMs = 0;
  private fence: WebGLSync | null = null;
  private quality: Quality | null = null;
  private begun = 0;
  private readonly ends: number[] = [];

  constructor(private readonly gl: Gl) {}

  /** A picture is under way. */
  get busy(): boolean {
    return this.fence !== null;
  }

  start(quality: Quality): void {
    this.quality = quality;
    this.begun = performance.now();
  }

  end(): void {
    this.fence = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.gl.flush();
  }

  /** The picture that was under way and is done, once. */
  poll(): {quality: Quality; ms: number} | null {
    const {gl, fence, quality} = this;
    if (fence === null || quality === null) return null;
    if (gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED) return null;
    gl.deleteSync(fence);
    this.fence = null;
    const now = performance.now();
    this.lastMs = now - this.begun;
    this.ends.push(now);
    if (this.ends.length > 30) this.ends.shift();
    return {quality, ms: this.lastMs};
  }

  /** Over the pictures of the last second. */
  get framesPerSecond(): number {
    const now = performance.now();
    return this.ends.filter((end) => now - end < 1000).length;
  }

  /** The context was lost: nothing is under way. */
  forget(): void {
    this.fence = null;
  }
}
