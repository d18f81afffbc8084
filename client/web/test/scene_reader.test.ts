import assert from 'node:assert/strict';
import {test} from 'node:test';
import {deflateSync} from 'node:zlib';

import {create} from '@bufbuild/protobuf';
import {MeshoptDecoder} from 'three/examples/jsm/libs/meshopt_decoder.module.js';

import type {GeometryChunk, SceneManifest} from '../src/gen/darm_pb.js';
import {GeometryChunkSchema, SceneManifestSchema} from '../src/gen/darm_pb.js';
import {ChunkReader, mostRecords, pageEntry, readManifest, Refused} from '../src/worker/scene_reader.js';

await MeshoptDecoder.ready;

const pack = (bytes: Uint8Array): Uint8Array => new Uint8Array(deflateSync(bytes));

// A meshopt vertex buffer (version 0) of at most 16 zero records of `stride` bytes, packed: the header, for each byte one group of
// 16 deltas that are all zero, and the tail with the first record.
function zeroVertices(stride: number): Uint8Array {
  const tail = Math.max(32, stride);
  return pack(new Uint8Array([0xa0, ...new Array<number>(stride).fill(0), ...new Array<number>(tail).fill(0)]));
}

const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

function manifest(): SceneManifest {
  return create(SceneManifestSchema, {
    q: 8, patchCount: 2, patchTable: zeroVertices(12), bounds: [0, 0, 0, 1, 1, 1], chartCount: 1, geometryChunks: 1,
    levels: [{density: 8, width: 30, height: 60, tilesX: 1, tilesY: 2},
      {density: 4, width: 30, height: 30, tilesX: 1, tilesY: 1}],
    instances: [{chart: 0, toWorld: [...identity], frontBase: 0, backBase: 0xffffffff, transmission: 3,
      tintRgb: 0xff0000}],
    origin: {x: 1, y: 2, z: 3}, sky: [0, 0, 4, 0.5, 0.5, 0.5, -1, 0, 0],
  });
}

test('a manifest is read, its levels follow each other in the page table', () => {
  const scene = readManifest(manifest());
  assert.equal(scene.tileCount, 3);
  assert.equal(pageEntry(scene.levels, (1 << 28) | 0), 2);
  assert.equal(pageEntry(scene.levels, 2), -1);
  assert.equal(pageEntry(scene.levels, (2 << 28) >>> 0), -1);
  assert.equal(pageEntry(scene.levels, (15 << 28) >>> 0), -1);
  assert.deepEqual(scene.origin, [1, 2, 3]);
  assert.equal(scene.instances[0]!.transmission, 1);
  assert.ok(scene.hasClear && !scene.hasAlpha);
  assert.deepEqual(scene.background, {zenith: [0, 0, 4], horizon: [0.5, 0.5, 0.5], ground: [0, 0, 0], sun: null});
  assert.equal(scene.coarseCoverage, null);
  const cut = manifest();
  cut.coarseCoverage = pack(new Uint8Array(900).fill(9));
  assert.deepEqual(readManifest(cut).coarseCoverage, new Uint8Array(900).fill(9));
});

test('a manifest that contradicts itself is refused', () => {
  const faults: ((m: SceneManifest) => void)[] = [
    (m) => (m.q = NaN), (m) => (m.levels = []), (m) => (m.levels[0]!.width = 31), (m) => (m.levels[0]!.tilesX = 0),
    (m) => (m.levels[0]!.density = -1), (m) => (m.patchCount = 0), (m) => (m.patchCount = 4_000_000),
    (m) => (m.patchTable = new Uint8Array(5)), (m) => (m.bounds = [1, 2]), (m) => (m.bounds[3] = Infinity),
    (m) => (m.instances[0]!.chart = 1), (m) => (m.instances[0]!.toWorld[5] = NaN), (m) => (m.instances[0]!.toWorld = []),
    (m) => (m.instances[0]!.frontBase = 2), (m) => (m.instances[0]!.backBase = 7), (m) => (m.instances[0]!.alphaMode = 3),
    (m) => (m.instances[0]!.f0 = NaN), (m) => (m.sky = [1, 2, 3]), (m) => (m.sky[8] = NaN),
    (m) => (m.sun = [1, 2, 3]), (m) => (m.sun = [0, 0, 0, 1, 1, 1, 1]),
    (m) => (m.coarseCoverage = new Uint8Array(3)), (m) => (m.coarseCoverage = pack(new Uint8Array(899))),
    (m) => (m.coarseCoverage = pack(new Uint8Array(901))), (m) => (m.geometryChunks = 2 ** 31), (m) => (m.origin!.x = Infinity),
    (m) => (m.levels = Array.from({length: 17}, () => m.levels[0]!)),
  ];
  for (const fault of faults) {
    const m = manifest();
    fault(m);
    assert.throws(() => readManifest(m), Refused, String(fault));
  }
});

test('a chunk that contradicts itself is refused, and one that fits comes once', () => {
  const chunk = (more: object = {}): GeometryChunk => create(GeometryChunkSchema, {
    chart: 0, index: 0, vertexCount: 3, indexCount: 0, vertices: zeroVertices(24), ...more});
  const reader = new ChunkReader(readManifest(manifest()));
  for (const more of [{index: 1}, {vertexCount: 5000}, {vertexCount: 2 ** 31}, {indexCount: 3},
    {indexCount: 1, indices: new Uint8Array(9)}, {vertices: new Uint8Array(40)},
    {vertices: pack(new Uint8Array(1e6))}, {positionStep: NaN}, {uvStep: Infinity}, {indexCount: 3, indices: new Uint8Array(9)}]) {
    assert.throws(() => reader.read(chunk(more)), Refused, JSON.stringify(more));
    assert.equal(reader.complete, false);
  }
  assert.equal(reader.read(chunk()).vertices.length, 72);
  assert.ok(reader.complete);
  assert.throws(() => reader.read(chunk()), /came twice/);
});

test('what claims more vertices than its bytes can hold is seen before memory is taken', () => {
  assert.ok(mostRecords(100, 24) >= 256);
  assert.ok(mostRecords(100_000, 24) < 300_000);
});
