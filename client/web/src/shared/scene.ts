// What the page is told of the scene and the stream: checked by the worker, ready to upload.

export type Vec3 = [number, number, number];

export interface LevelShape {
  /** Texels per world unit. */
  density: number;
  width: number;
  height: number;
  tilesX: number;
  tilesY: number;
  /** Place of this level's tile 0 in the linear page table. */
  firstTile: number;
}

export type AlphaMode = 'opaque' | 'mask' | 'blend';

export interface InstanceShape {
  chart: number;
  /** 16, column major, into recentred world space. */
  toWorld: number[];
  frontBase: number;
  backBase: number;
  flipped: boolean;
  alphaMode: AlphaMode;
  alphaCutoff: number;
  transmission: number;
  /** Linear. */
  tint: Vec3;
  /** > 0: with the private layer, what is not reflected is dimmed by 1 - Fresnel. */
  f0: number;
  cameraSeesBack: boolean;
}

export interface Background {
  /** Linear. */
  zenith: Vec3;
  horizon: Vec3;
  ground: Vec3;
  /** To the disc (unit), cosine of its radius, colour (linear, exposed). */
  sun: {direction: Vec3; cosine: number; rgb: Vec3} | null;
}

export interface SceneShape {
  name: string;
  /** File coordinates = recentred + origin. */
  origin: Vec3;
  low: Vec3;
  high: Vec3;
  q: number;
  levels: LevelShape[];
  patchCount: number;
  tileCount: number;
  /** Level-major triples {u32 x, u32 y, f32 scale}. */
  places: Uint32Array;
  instances: InstanceShape[];
  chunkCount: number;
  background: Background;
  hasAlpha: boolean;
  /** Alpha of CoarseTex, a byte for each texel of the last level; null: opaque. */
  coarseCoverage: Uint8Array | null;
  hasClear: boolean;
}

export interface Chunk {
  chart: number;
  index: number;
  /** 24 bytes a vertex: f32 position[3] (node space), f32 uv[2], u32 local patch. */
  vertices: Uint8Array;
  indices: Uint32Array;
  /** Box of the positions, node space. */
  low: Vec3;
  high: Vec3;
}

/** 8-bit planes of one picture, tightly packed in one buffer. */
export interface Planes {
  width: number;
  height: number;
  chroma444: boolean;
  buffer: ArrayBuffer;
  /** Byte offsets into `buffer`. */
  y: number;
  cb: number;
  cr: number;
}

export interface StreamShape {
  /** PhysTex, pixels square. */
  size: number;
  /** Private PhysTex; 0: none. */
  viewSize: number;
}

/** Rows of the page table that changed. */
export interface PageRows {
  first: number;
  count: number;
  slots: Uint16Array;
}

/** Bytes of one slot: 32x32 coverage or 32x32x3 of what a clear surface passes. */
export interface SlotBytes {
  slot: number;
  bytes: Uint8Array;
}

/** Applied whole: picture and page table belong together. */
export interface FrameUpdate {
  layer: 'shared' | 'view';
  frame: number;
  /** The first of a session: what slots held before means nothing. */
  fresh: boolean;
  /** Absent: the picture stays. */
  picture: Planes | null;
  pages: PageRows[];
  coverage: SlotBytes[];
  through: SlotBytes[];
}

export function slotCount(size: number): number {
  const row = size / 32;
  return Math.min(row * row, 65535);
}
