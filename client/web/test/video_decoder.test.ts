import assert from 'node:assert/strict';
import {test} from 'node:test';

import {NoDecoder, PictureDecoder} from '../src/worker/video_decoder.js';
import {ScriptedBrowser} from './scripted_browser.js';

const browser = new ScriptedBrowser();
const key = new Uint8Array([0, 0, 0, 1, 0x67, 0x64, 0x00, 0x32, 1]);

// A decoder as browsers have them, with their moods.
class ScriptedVideoDecoder {
  static holdsBack = false;
  static format: string | null = 'I420';
  static takes = true;
  static readonly software: boolean[] = [];
  state = 'unconfigured';
  constructor(private readonly to: {output: (frame: unknown) => void; error: (error: Error) => void}) {}
  configure(config: {hardwareAcceleration: string}): void {
    this.state = 'configured';
    ScriptedVideoDecoder.software.push(config.hardwareAcceleration === 'prefer-software');
  }
  decode(chunk: {timestamp: number}): void {
    if (!ScriptedVideoDecoder.takes) {
      return this.to.error(Object.assign(new Error('no'), {name: 'NotSupportedError'}));
    }
    if (ScriptedVideoDecoder.holdsBack && !ScriptedVideoDecoder.software.at(-1)) return;
    const format = ScriptedVideoDecoder.software.at(-1) ? 'I420' : ScriptedVideoDecoder.format;
    this.to.output({timestamp: chunk.timestamp, format, visibleRect: {width: 4, height: 2}, close: () => {},
      copyTo: async () => []});
  }
  flush(): Promise<void> {
    return Promise.resolve();
  }
  close(): void {
    this.state = 'closed';
  }
}
Object.assign(globalThis, {VideoDecoder: ScriptedVideoDecoder, EncodedVideoChunk: class {
  constructor(init: object) {
    Object.assign(this, init);
  }
}});

function fresh(): PictureDecoder {
  ScriptedVideoDecoder.software.length = 0;
  return new PictureDecoder((bytes) => new ArrayBuffer(bytes));
}

test('pictures come as planes, one by one; without a key frame none does', async () => {
  ScriptedVideoDecoder.holdsBack = false;
  ScriptedVideoDecoder.format = 'I420';
  const decoder = fresh();
  await assert.rejects(decoder.decode(key, false, 1), /no key frame yet/);
  const planes = await decoder.decode(key, true, 1);
  assert.deepEqual([planes.width, planes.height, planes.cb, planes.cr, planes.chroma444], [4, 2, 8, 10, false]);
  await decoder.decode(new Uint8Array([0, 0, 1, 0x41]), false, 2);
  assert.deepEqual(ScriptedVideoDecoder.software, [false], 'the same decoder');
  await browser.pass(10_000);
  await decoder.decode(new Uint8Array([0, 0, 1, 0x41]), false, 3);
});

test('a decoder that holds pictures back is given up, and the next is in software', async () => {
  ScriptedVideoDecoder.holdsBack = true;
  const decoder = fresh();
  for (let i = 0; i < 2; ++i) {
    const waiting = assert.rejects(decoder.decode(key, true, i), /was reset/);
    await browser.pass(10_100);
    await waiting;
  }
  assert.deepEqual(ScriptedVideoDecoder.software, [false, false], 'once may be a machine that slept');
  await decoder.decode(key, true, 3);
  assert.deepEqual(ScriptedVideoDecoder.software, [false, false, true]);
});

test('a still is waited for as long as it takes', async () => {
  ScriptedVideoDecoder.holdsBack = true;
  ScriptedVideoDecoder.software.length = 0;
  const decoder = new PictureDecoder((bytes) => new ArrayBuffer(bytes), true);
  let given = false;
  void decoder.decode(key, true, 1).then(() => (given = true), () => (given = true));
  await browser.pass(60_000);
  assert.ok(!given);
  decoder.reset();
  await browser.settle();
  assert.ok(given);
});

test('pictures that cannot be read are asked for in software once; then it is said', async () => {
  ScriptedVideoDecoder.holdsBack = false;
  ScriptedVideoDecoder.format = null;
  const decoder = fresh();
  await assert.rejects(decoder.decode(key, true, 1), /is changed/);
  await decoder.decode(key, true, 2);
  assert.deepEqual(ScriptedVideoDecoder.software, [false, true]);
  ScriptedVideoDecoder.takes = false;
  await assert.rejects(fresh().decode(key, true, 1), NoDecoder);
  ScriptedVideoDecoder.takes = true;
});
