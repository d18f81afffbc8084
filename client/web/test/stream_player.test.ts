import assert from 'node:assert/strict';
import {test} from 'node:test';
import {deflateSync} from 'node:zlib';

import {create} from '@bufbuild/protobuf';

import type {StreamFrame} from '../src/gen/darm_pb.js';
import {PageEditSchema, StreamFrameSchema} from '../src/gen/darm_pb.js';
import type {Planes, SceneShape} from '../src/shared/scene.js';
import {Refused} from '../src/worker/scene_reader.js';
import {StreamPlayer} from '../src/worker/stream_player.js';
import type {Decoder} from '../src/worker/stream_player.js';

const scene = {tileCount: 40, levels: [
  {density: 8, width: 150, height: 180, tilesX: 5, tilesY: 6, firstTile: 0},
  {density: 4, width: 60, height: 150, tilesX: 2, tilesY: 5, firstTile: 30},
]} as unknown as SceneShape;

class ScriptedDecoder implements Decoder {
  fails = false;
  size = 64;
  resets = 0;
  decode(): Promise<Planes> {
    if (this.fails) return Promise.reject(new Error('damaged'));
    return Promise.resolve({width: this.size, height: this.size, chroma444: false, buffer: new ArrayBuffer(8), y: 0, cb: 0,
      cr: 0});
  }
  reset(): void {
    ++this.resets;
  }
}

type Edit = {tile: number; slot: number; coverage?: Uint8Array; through?: Uint8Array};

function frame(number: number, key: boolean, edits: Edit[] = [], h264 = new Uint8Array([1])): StreamFrame {
  const pageEdits = edits.map((e) => create(PageEditSchema, e));
  return create(StreamFrameSchema, {frame: BigInt(number), key, h264, pageEdits});
}

function player(decoder: Decoder = new ScriptedDecoder()): StreamPlayer {
  return new StreamPlayer('shared', scene, 64, decoder);
}

test('picture and pages of a frame come together, the first time with the whole table', async () => {
  const p = player();
  const update = await p.apply(frame(4, true, [{tile: 3, slot: 2}, {tile: (1 << 28) | 1, slot: 0}]));
  assert.ok(update?.picture && update.fresh);
  assert.equal(update.pages[0]!.slots[3], 2);
  assert.equal(update.pages[0]!.slots[31], 0, 'the second level begins behind the first');
  assert.equal(p.resident, 2);
  const next = await p.apply(frame(5, false, [{tile: 3, slot: 65535}], new Uint8Array()));
  assert.equal(next?.picture, null, 'a frame of page edits alone keeps the picture');
  assert.equal(next?.pages[0]!.slots[3], 65535);
  assert.equal(next?.fresh, false);
});

test('a gap or damage skips both until the next key frame', async () => {
  const decoder = new ScriptedDecoder();
  const p = player(decoder);
  assert.equal(await p.apply(frame(1, false)), null, 'nothing is applied before a key frame');
  await p.apply(frame(1, true, [{tile: 0, slot: 1}]));
  assert.equal(await p.apply(frame(3, false, [{tile: 0, slot: 65535}])), null);
  assert.ok(p.keyWanted);
  assert.equal(p.resident, 1, 'the page table stays that of the last picture');
  assert.equal(await p.apply(frame(4, false)), null);
  assert.ok(await p.apply(frame(5, true)));
  assert.equal(p.resident, 0, 'a key frame holds the whole table');
  decoder.fails = true;
  assert.equal(await p.apply(frame(6, false, [{tile: 0, slot: 1}])), null);
  assert.ok(p.keyWanted && decoder.resets > 0);
  assert.equal(p.resident, 0);
});

test('another stream is gone over to with a key frame only; until then everything stays', async () => {
  const p = player();
  const of = (stream: bigint, f: StreamFrame): StreamFrame => ({...f, stream});
  await p.apply(of(4n, frame(7, true, [{tile: 0, slot: 1}])));
  assert.equal(await p.apply(of(5n, frame(8, false, [{tile: 0, slot: 65535}]))), null, 'though its number would follow');
  assert.ok(p.keyWanted);
  assert.equal(p.resident, 1);
  const update = await p.apply(of(5n, frame(3, true, [{tile: 2, slot: 3}, {tile: 3, slot: 0}])));
  assert.ok(update?.picture);
  assert.equal(update.fresh, false, 'of the same session');
  assert.equal(p.resident, 2, 'the whole table is that of the new stream');
  assert.ok(await p.apply(of(5n, frame(4, false))));
  assert.equal(await p.apply(of(4n, frame(5, false))), null, 'a late one of the stream before');
});

test('what contradicts the manifest is refused', async () => {
  const small = new Uint8Array(deflateSync(new Uint8Array(1023)));
  const large = new Uint8Array(deflateSync(new Uint8Array(1_000_000)));
  for (const edit of [{tile: 30, slot: 0}, {tile: (2 << 28) >>> 0, slot: 0}, {tile: 0, slot: 4},
    {tile: 0, slot: 0, coverage: small}, {tile: 0, slot: 0, coverage: large}, {tile: 0, slot: 0, through: new Uint8Array([1, 2, 3])}] as Edit[]) {
    await assert.rejects(player().apply(frame(1, true, [edit])), Refused, JSON.stringify(edit.tile));
  }
  const decoder = new ScriptedDecoder();
  decoder.size = 32;
  await assert.rejects(player(decoder).apply(frame(1, true)), Refused, 'another size than agreed');
});

test('coverage stays with its tile and leaves with it', async () => {
  const p = player();
  const mask = new Uint8Array(1024).fill(9);
  const first = await p.apply(frame(1, true, [{tile: 0, slot: 1, coverage: new Uint8Array(deflateSync(mask))}]));
  assert.deepEqual(first?.coverage, [{slot: 1, bytes: mask}]);
  const same = await p.apply(frame(2, true, [{tile: 0, slot: 1}]));
  assert.deepEqual(same?.coverage, [], 'the tile stays: so does its coverage');
  const other = await p.apply(frame(3, false, [{tile: 4, slot: 1}]));
  assert.deepEqual(other?.coverage, [{slot: 1, bytes: new Uint8Array(1024).fill(255)}], 'another tile is opaque');
});
