// The textures behind one session: slots and pages of its streams, patch places, coverage, CoarseTex.
import {kSlotSize, kTableWidth} from '../shared/limits.js';
import type {FrameUpdate, PageRows, Planes, SceneShape, SlotBytes, StreamShape} from '../shared/scene.js';
import type {Gl} from './gl_resources.js';
import {clearTexture, makeTexture, put} from './gl_resources.js';
import {kUnits} from './programs.js';

function plane(gl: Gl, width: number, height: number): WebGLTexture {
  return makeTexture(gl, gl.R8, width, height, gl.LINEAR);
}

function putPlane(gl: Gl, texture: WebGLTexture, width: number, height: number, bytes: Uint8Array): void {
  put(gl, texture, 0, 0, width, height, gl.RED, gl.UNSIGNED_BYTE, bytes);
}

/** Three planes of one picture. */
class PlaneTextures {
  width = 0;
  height = 0;
  chroma444 = false;
  y: WebGLTexture | null = null;
  cb: WebGLTexture | null = null;
  cr: WebGLTexture | null = null;

  constructor(private readonly gl: Gl) {}

  put(p: Planes): void {
    const gl = this.gl;
    const cw = p.chroma444 ? p.width : (p.width + 1) >> 1;
    const ch = p.chroma444 ? p.height : (p.height + 1) >> 1;
    if (this.y === null || p.width !== this.width || p.height !== this.height || p.chroma444 !== this.chroma444) {
      for (const old of [this.y, this.cb, this.cr]) gl.deleteTexture(old);
      this.y = plane(gl, p.width, p.height);
      this.cb = plane(gl, cw, ch);
      this.cr = plane(gl, cw, ch);
      this.width = p.width;
      this.height = p.height;
      this.chroma444 = p.chroma444;
    }
    putPlane(gl, this.y, p.width, p.height, new Uint8Array(p.buffer, p.y, p.width * p.height));
    putPlane(gl, this.cb!, cw, ch, new Uint8Array(p.buffer, p.cb, cw * ch));
    putPlane(gl, this.cr!, cw, ch, new Uint8Array(p.buffer, p.cr, cw * ch));
  }
}

// Slots and pages of one stream.
class Slots {
  readonly planes: PlaneTextures;
  readonly pages: WebGLTexture;

  constructor(private readonly gl: Gl, pageRows: number) {
    this.planes = new PlaneTextures(gl);
    this.pages = makeTexture(gl, gl.R16UI, kTableWidth, pageRows, gl.NEAREST);
    const absent = new Uint16Array(kTableWidth * pageRows).fill(65535);
    put(gl, this.pages, 0, 0, kTableWidth, pageRows, gl.RED_INTEGER, gl.UNSIGNED_SHORT, absent);
  }

  apply(picture: Planes | null, rows: PageRows[]): void {
    if (picture !== null) this.planes.put(picture);
    for (const r of rows) {
      put(this.gl, this.pages, 0, r.first, kTableWidth, r.count, this.gl.RED_INTEGER, this.gl.UNSIGNED_SHORT, r.slots);
    }
  }
}

export class StreamTextures {
  private readonly places: WebGLTexture;
  private readonly shared: Slots;
  private view: Slots | null = null;
  private coverage: WebGLTexture | null = null;
  private through: WebGLTexture | null = null;
  private readonly coarseCoverage: WebGLTexture | null;
  private coverageSize = 0;
  private throughSize = 0;
  readonly coarse: PlaneTextures;
  private readonly pageRows: number;

  constructor(private readonly gl: Gl, private readonly scene: SceneShape) {
    const largest = gl.getParameter(gl.MAX_TEXTURE_SIZE) as number;
    const rows = Math.ceil(scene.places.length / 3 / kTableWidth);
    this.pageRows = Math.max(1, Math.ceil(scene.tileCount / kTableWidth));
    if (Math.max(rows, this.pageRows) > largest) {
      throw new Error('the scene has more patches than this device has room for');
    }
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    const texels = new Uint32Array(rows * kTableWidth * 4);
    for (let i = 0, j = 0; i < scene.places.length; i += 3, j += 4) texels.set(scene.places.subarray(i, i + 3), j);
    this.places = makeTexture(gl, gl.RGBA32UI, kTableWidth, rows, gl.NEAREST);
    put(gl, this.places, 0, 0, kTableWidth, rows, gl.RGBA_INTEGER, gl.UNSIGNED_INT, texels);
    this.shared = new Slots(gl, this.pageRows);
    this.coarse = new PlaneTextures(gl);
    this.coarseCoverage = scene.hasAlpha ? this.makeCoarseCoverage(largest) : null;
  }

  /** Sizes of the session's streams; what slots held before means nothing once its first frame comes. */
  begin(shape: StreamShape, layer: 'shared' | 'view'): void {
    if (layer === 'shared' && this.scene.hasAlpha) {
      this.coverage = this.filled(this.coverage, this.coverageSize, shape.size, this.gl.R8, 1);
      this.coverageSize = shape.size;
    }
    if (layer === 'view' && this.scene.hasClear) {
      this.through = this.filled(this.through, this.throughSize, shape.viewSize, this.gl.RGB8, 0);
      this.throughSize = shape.viewSize;
    }
  }

  apply(update: FrameUpdate): void {
    this.gl.pixelStorei(this.gl.UNPACK_ALIGNMENT, 1);
    this.gl.activeTexture(this.gl.TEXTURE0);
    if (update.layer === 'shared') {
      this.shared.apply(update.picture, update.pages);
      this.putSlots(this.coverage, this.coverageSize, update.coverage, this.gl.RED);
    } else {
      this.view ??= new Slots(this.gl, this.pageRows);
      this.view.apply(update.picture, update.pages);
      this.putSlots(this.through, this.throughSize, update.through, this.gl.RGB);
    }
  }

  putCoarse(picture: Planes): void {
    this.gl.pixelStorei(this.gl.UNPACK_ALIGNMENT, 1);
    this.gl.activeTexture(this.gl.TEXTURE0);
    this.coarse.put(picture);
  }

  get hasCoarse(): boolean {
    return this.coarse.y !== null;
  }

  /** The private layer has a picture. */
  get hasView(): boolean {
    return this.view !== null && this.view.planes.y !== null;
  }

  get viewSize(): number {
    return this.view?.planes.width ?? 0;
  }

  get sharedSize(): number {
    return this.shared.planes.width;
  }

  get chromaStep(): number {
    return this.shared.planes.chroma444 ? 1 : 0.5;
  }

  get viewChromaStep(): number {
    return this.view?.planes.chroma444 === true ? 1 : 0.5;
  }

  bind(): void {
    const gl = this.gl;
    const textures: Record<(typeof kUnits)[number], WebGLTexture | null> = {
      u_places: this.places, u_pages: this.shared.pages, u_y: this.shared.planes.y, u_cb: this.shared.planes.cb,
      u_cr: this.shared.planes.cr, u_coverage: this.coverage, u_coarse_y: this.coarse.y, u_coarse_cb: this.coarse.cb,
      u_coarse_cr: this.coarse.cr, u_view_pages: this.view?.pages ?? null, u_view_y: this.view?.planes.y ?? null,
      u_view_cb: this.view?.planes.cb ?? null, u_view_cr: this.view?.planes.cr ?? null, u_through: this.through,
      u_coarse_coverage: this.coarseCoverage,
    };
    kUnits.forEach((name, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, textures[name]);
    });
    gl.activeTexture(gl.TEXTURE0);
  }

  private makeCoarseCoverage(largest: number): WebGLTexture {
    const bytes = this.scene.coarseCoverage;
    const last = this.scene.levels[this.scene.levels.length - 1]!;
    const width = bytes === null ? 1 : last.width;
    const height = bytes === null ? 1 : last.height;
    if (Math.max(width, height) > largest) throw new Error('the scene is larger than a texture of this device');
    const texture = plane(this.gl, width, height);
    putPlane(this.gl, texture, width, height, bytes ?? new Uint8Array([255]));
    return texture;
  }

  // A texture of one value everywhere, made anew where the size differs.
  private filled(old: WebGLTexture | null, oldSize: number, size: number, internal: number,
                 value: number): WebGLTexture {
    const gl = this.gl;
    let texture = old;
    if (texture === null || oldSize !== size) {
      gl.deleteTexture(old);
      texture = makeTexture(gl, internal, size, size, gl.LINEAR);
    }
    clearTexture(gl, texture, value);
    return texture;
  }

  private putSlots(texture: WebGLTexture | null, size: number, slots: SlotBytes[], format: number): void {
    if (texture === null) return;
    const perRow = size / kSlotSize;
    for (const {slot, bytes} of slots) {
      put(this.gl, texture, (slot % perRow) * kSlotSize, Math.floor(slot / perRow) * kSlotSize, kSlotSize, kSlotSize,
          format, this.gl.UNSIGNED_BYTE, bytes);
    }
  }
}
