// Manifest and geometry chunks, decoded and checked: what contradicts itself is refused before memory is taken for it.
import {MeshoptDecoder} from 'three/examples/jsm/libs/meshopt_decoder.module.js';

import type {GeometryChunk, InstanceInfo, SceneManifest} from '../gen/darm_pb.js';
import {kMaxChunkIndices, kMaxChunkVertices, kMaxChunks, kMaxCoarseTexels, kMaxGeometryBytes, kMaxInstances, kMaxLevels,
  kMaxTableEntries, kNoBase, kPatchEntryBytes, kTileSize, kVertexBytes} from '../shared/limits.js';
import type {AlphaMode, Background, Chunk, InstanceShape, LevelShape, SceneShape, Vec3} from '../shared/scene.js';
import {inflate} from './inflate.js';

/** The server contradicts itself; its message starts with the thing at fault. */
export class Refused extends Error {}

function check(holds: boolean, fault: string): asserts holds {
  if (!holds) throw new Refused(fault);
}

const finite = (values: readonly number[]): boolean => values.every(Number.isFinite);
const clamp01 = (value: number): number => Math.min(1, Math.max(0, value));

export function srgbToLinear(encoded: number): number {
  return encoded <= 0.04045 ? encoded / 12.92 : ((encoded + 0.055) / 1.055) ** 2.4;
}

export function linearToSrgb(linear: number): number {
  return linear <= 0.0031308 ? linear * 12.92 : 1.055 * linear ** (1 / 2.4) - 0.055;
}

function unpackLinear(rgb: number): Vec3 {
  const channel = (shift: number): number => srgbToLinear(((rgb >>> shift) & 255) / 255);
  return [channel(16), channel(8), channel(0)];
}

// The same bounds as proto/limits.hpp.
const mostInflated = (bytes: number): number => bytes * 1032;
const mostPackedIndices = (count: number): number => (count / 3) * 17 + 64;

function mostPackedRecords(count: number, stride: number): number {
  return (count + 32) * stride + (Math.floor(count / 256) + 1) * stride * 4 + 64;
}

/** Most records of `stride` bytes that a meshopt vertex buffer of `bytes` can hold. */
export function mostRecords(bytes: number, stride: number): number {
  return (Math.floor(bytes / (stride * 4)) + 1) * 256;
}

function decodeRecords(packed: Uint8Array, count: number, stride: number, fault: string): Uint8Array<ArrayBuffer> {
  if (count === 0) return new Uint8Array(0);
  const bytes = inflate(packed, Math.min(mostPackedRecords(count, stride), mostInflated(packed.length)));
  check(bytes !== null && count <= mostRecords(bytes.length, stride), fault);
  const out = new Uint8Array(count * stride);
  decode(fault, () => MeshoptDecoder.decodeVertexBuffer(out, count, stride, bytes));
  return out;
}

function decodeIndices(packed: Uint8Array, count: number, fault: string): Uint32Array<ArrayBuffer> {
  if (count === 0) return new Uint32Array(0);
  const bytes = inflate(packed, Math.min(mostPackedIndices(count), mostInflated(packed.length)));
  // The codec spends at least one byte on a triangle.
  check(bytes !== null && count / 3 <= bytes.length, fault);
  const out = new Uint32Array(count);
  decode(fault, () => MeshoptDecoder.decodeIndexBuffer(new Uint8Array(out.buffer), count, 4, bytes));
  return out;
}

function readLevels(manifest: SceneManifest): LevelShape[] {
  const count = manifest.levels.length;
  check(count > 0 && count <= kMaxLevels, `manifest: ${count} levels, expected 1 to ${kMaxLevels}`);
  let tiles = 0;
  return manifest.levels.map((info) => {
    check(Number.isFinite(info.density) && info.density > 0, 'manifest: level without a density');
    check(info.tilesX > 0 && info.tilesY > 0 && info.tilesX * kTileSize === info.width &&
              info.tilesY * kTileSize === info.height,
          'manifest: a level is not a whole number of tiles');
    const level: LevelShape = {density: info.density, width: info.width, height: info.height, tilesX: info.tilesX,
      tilesY: info.tilesY, firstTile: tiles};
    tiles += info.tilesX * info.tilesY;
    check(tiles <= kMaxTableEntries, `manifest: over ${kMaxTableEntries} tiles`);
    return level;
  });
}

function readPlaces(manifest: SceneManifest, levels: LevelShape[]): Uint32Array {
  const entries = manifest.patchCount * levels.length;
  check(manifest.patchCount > 0 && entries <= kMaxTableEntries, `manifest: ${manifest.patchCount} patches refused`);
  const places = new Uint32Array(
    decodeRecords(manifest.patchTable, entries, kPatchEntryBytes, 'manifest: patch table does not decode').buffer);
  const scales = new Float32Array(places.buffer);
  levels.forEach((level, l) => {
    for (let i = l * manifest.patchCount; i < (l + 1) * manifest.patchCount; ++i) {
      const scale = scales[i * 3 + 2]!;
      check(places[i * 3]! < level.width && places[i * 3 + 1]! < level.height && Number.isFinite(scale) && scale >= 0,
            'manifest: a patch lies outside its level');
    }
  });
  return places;
}

function decode(fault: string, work: () => void): void {
  try {
    work();
  } catch {
    throw new Refused(fault);
  }
}

function readInstance(info: InstanceInfo, manifest: SceneManifest): InstanceShape {
  check(info.chart < manifest.chartCount, 'manifest: an instance names no chart');
  check(info.toWorld.length === 16 && finite(info.toWorld), 'manifest: an instance has no finite matrix');
  check(info.frontBase < manifest.patchCount && (info.backBase === kNoBase || info.backBase < manifest.patchCount),
        "manifest: an instance's patches are out of range");
  const alphaMode = (['opaque', 'mask', 'blend'] as const)[info.alphaMode] as AlphaMode | undefined;
  check(alphaMode !== undefined, 'manifest: unknown alpha mode');
  check(finite([info.alphaCutoff, info.transmission, info.f0]), 'manifest: NaN in an instance');
  return {
    chart: info.chart,
    toWorld: info.toWorld,
    frontBase: info.frontBase,
    backBase: info.backBase,
    flipped: info.flipped,
    alphaMode,
    alphaCutoff: info.alphaCutoff,
    transmission: clamp01(info.transmission),
    tint: unpackLinear(info.tintRgb),
    f0: clamp01(info.f0),
    cameraSeesBack: info.cameraSeesBack,
  };
}

function readBackground(manifest: SceneManifest): Background {
  check(manifest.sky.length === 9 && finite(manifest.sky), 'manifest: the sky is not nine finite numbers');
  const light = (at: number): Vec3 => [0, 1, 2].map((c) => Math.max(0, manifest.sky[at + c]!)) as Vec3;
  const sky = {zenith: light(0), horizon: light(3), ground: light(6)};
  const s = manifest.sun;
  if (s.length === 0) return {...sky, sun: null};
  check(s.length === 7 && finite(s), 'manifest: the sun is not seven finite numbers');
  const length = Math.hypot(s[0]!, s[1]!, s[2]!);
  check(length > 1e-6, 'manifest: the sun has no direction');
  return {...sky, sun: {
    direction: [s[0]! / length, s[1]! / length, s[2]! / length],
    cosine: s[3]!,
    rgb: [Math.max(0, s[4]!), Math.max(0, s[5]!), Math.max(0, s[6]!)],
  }};
}

function readCoarseCoverage(manifest: SceneManifest, last: LevelShape): Uint8Array | null {
  const packed = manifest.coarseCoverage;
  if (packed.length === 0) return null;
  const texels = last.width * last.height;
  const most = Math.min(kMaxCoarseTexels, mostInflated(packed.length));
  const bytes = texels <= most ? inflate(packed, texels) : null;
  check(bytes !== null && bytes.length === texels, 'manifest: coverage of CoarseTex does not fit the last level');
  return bytes;
}

export function readManifest(manifest: SceneManifest): SceneShape {
  check(Number.isFinite(manifest.q) && manifest.q > 0, 'manifest: q is not a positive number');
  const levels = readLevels(manifest);
  const places = readPlaces(manifest, levels);
  check(manifest.instances.length <= kMaxInstances, 'manifest: too many instances');
  check(manifest.chartCount <= kMaxInstances, 'manifest: too many charts');
  check(manifest.geometryChunks <= kMaxChunks, 'manifest: too many geometry chunks');
  const instances = manifest.instances.map((info) => readInstance(info, manifest));
  const origin = manifest.origin;
  check(origin === undefined || finite([origin.x, origin.y, origin.z]), 'manifest: origin is not finite');
  const b = manifest.bounds;
  check(b.length === 6 && finite(b), 'manifest: bounds are not six finite numbers');
  const last = levels[levels.length - 1]!;
  return {
    name: manifest.name.slice(0, 200),
    origin: origin ? [origin.x, origin.y, origin.z] : [0, 0, 0],
    low: [b[0]!, b[1]!, b[2]!],
    high: [b[3]!, b[4]!, b[5]!],
    q: manifest.q,
    levels,
    patchCount: manifest.patchCount,
    tileCount: last.firstTile + last.tilesX * last.tilesY,
    places,
    instances,
    chunkCount: manifest.geometryChunks,
    background: readBackground(manifest),
    hasAlpha: instances.some((i) => i.alphaMode !== 'opaque'),
    coarseCoverage: readCoarseCoverage(manifest, last),
    hasClear: instances.some((i) => i.transmission > 0),
  };
}

/** The entry of a tile (level << 28 | index) in the page table; -1: there is no such tile. */
export function pageEntry(levels: readonly LevelShape[], tile: number): number {
  const level = levels[tile >>> 28];
  const index = tile & 0x0fffffff;
  return level !== undefined && index < level.tilesX * level.tilesY ? level.firstTile + index : -1;
}

// Integers of the grid become the numbers they stand for, in place.
function takeOffGrid(info: GeometryChunk, vertices: Uint8Array<ArrayBuffer>): void {
  const grid = new Int32Array(vertices.buffer);
  const floats = new Float32Array(vertices.buffer);
  for (let v = 0; v < grid.length; v += 6) {
    for (let i = v; i < v + 3; ++i) floats[i] = grid[i]! * info.positionStep;
    for (let i = v + 3; i < v + 5; ++i) floats[i] = grid[i]! * info.uvStep;
  }
}

/** Reads the chunks of one scene; a refused one throws. */
export class ChunkReader {
  private readonly seen: Uint8Array;
  private readonly highestBase = new Map<number, number>();
  private bytes = 0;
  private count = 0;

  constructor(private readonly scene: SceneShape) {
    this.seen = new Uint8Array(scene.chunkCount);
    for (const i of scene.instances) {
      const highest = Math.max(i.frontBase, i.backBase === kNoBase ? 0 : i.backBase, this.highestBase.get(i.chart) ?? 0);
      this.highestBase.set(i.chart, highest);
    }
  }

  get complete(): boolean {
    return this.count === this.scene.chunkCount;
  }

  read(info: GeometryChunk): Chunk {
    const ok: (holds: boolean, what: string) => asserts holds = (holds, what) => {
      check(holds, `geometry chunk ${info.index}: ${what}`);
    };
    ok(info.index < this.seen.length, 'index is out of range');
    ok(this.seen[info.index] === 0, 'came twice');
    ok(info.vertexCount <= kMaxChunkVertices, 'too many vertices');
    ok(info.indexCount % 3 === 0 && info.indexCount <= kMaxChunkIndices, 'wrong number of indices');
    ok(finite([info.positionStep, info.uvStep]), 'a step is not finite');
    const bytes = info.vertexCount * kVertexBytes + info.indexCount * 4;
    ok(this.bytes + bytes <= kMaxGeometryBytes, 'geometry is over the limit');
    const vertices = decodeRecords(info.vertices, info.vertexCount, kVertexBytes,
                                   `geometry chunk ${info.index}: vertices do not decode`);
    const indices = decodeIndices(info.indices, info.indexCount, `geometry chunk ${info.index}: indices do not decode`);
    takeOffGrid(info, vertices);
    const box = this.checkVertices(info, vertices, ok);
    ok(indices.every((i) => i < info.vertexCount), 'an index is out of range');
    this.bytes += bytes;
    this.seen[info.index] = 1;
    ++this.count;
    return {chart: info.chart, index: info.index, vertices, indices, ...box};
  }

  private checkVertices(info: GeometryChunk, vertices: Uint8Array,
                        ok: (holds: boolean, what: string) => void): {low: Vec3; high: Vec3} {
    const floats = new Float32Array(vertices.buffer);
    const words = new Uint32Array(vertices.buffer);
    const patchesLeft = this.scene.patchCount - (this.highestBase.get(info.chart) ?? 0);
    const low: Vec3 = [Infinity, Infinity, Infinity];
    const high: Vec3 = [-Infinity, -Infinity, -Infinity];
    let sum = 0;
    for (let v = 0; v < floats.length; v += 6) {
      for (let axis = 0; axis < 3; ++axis) {
        const p = floats[v + axis]!;
        low[axis] = Math.min(low[axis]!, p);
        high[axis] = Math.max(high[axis]!, p);
        sum += 0 * p;
      }
      sum += 0 * (floats[v + 3]! + floats[v + 4]!);  // NaN as soon as one number is not finite
      ok(words[v + 5]! < patchesLeft, 'a patch is out of range');
    }
    ok(sum === 0, 'a vertex is not finite');
    return info.vertexCount > 0 ? {low, high} : {low: [0, 0, 0], high: [0, 0, 0]};
  }
}
