import assert from 'node:assert/strict';
import {test} from 'node:test';
import {deflateSync} from 'node:zlib';

import {create} from '@bufbuild/protobuf';

import {GoodbyeSchema, Goodbye_Reason, PingSchema, SceneManifestSchema, WelcomeSchema} from '../src/gen/darm_pb.js';
import {CoarseTextureSchema, StreamFrameSchema} from '../src/gen/darm_pb.js';
import type {FromWorker, Pose} from '../src/shared/messages.js';
import {Session} from '../src/worker/session.js';
import {ScriptedBrowser} from './scripted_browser.js';

const browser = new ScriptedBrowser();
const pose: Pose = {position: [1, 2, 3], orientation: [0, 0, 0, 1], fovy: 0.9, width: 640, height: 360};

type Told<T extends FromWorker['type']> = Extract<FromWorker, {type: T}>;

class Page {
  readonly told: FromWorker[] = [];
  readonly session = new Session('wss://scene.example/stream', 'test', true, null, (message) => this.told.push(message));

  all<T extends FromWorker['type']>(type: T): Told<T>[] {
    return this.told.filter((message): message is Told<T> => message.type === type);
  }

  last<T extends FromWorker['type']>(type: T): Told<T> {
    const found = this.all(type).at(-1);
    assert.ok(found, `${type} among ${this.told.map((message) => message.type).join()}`);
    return found;
  }
}

async function welcome(more = {}): Promise<void> {
  browser.line.accept();
  browser.line.say({case: 'welcome', value: create(WelcomeSchema, {version: 2, phystexSize: 64, updatesPerSecond: 10,
    ...more})});
  await browser.settle();
}

// One without geometry: a page that has it has the whole scene.
async function manifest(): Promise<void> {
  const zeros = deflateSync(new Uint8Array([0xa0, ...new Array<number>(12 + 32).fill(0)]));
  browser.line.say({case: 'manifest', value: create(SceneManifestSchema, {
    tag: 77n, q: 8, patchCount: 2, patchTable: new Uint8Array(zeros), bounds: [0, 0, 0, 1, 1, 1], chartCount: 1,
    levels: [{density: 8, width: 30, height: 30, tilesX: 1, tilesY: 1}], origin: {x: 0, y: 0, z: 0}, sky: new Array<number>(9).fill(0)})});
  await browser.settle();
}

function goodbye(reason: Goodbye_Reason, text: string): void {
  browser.line.say({case: 'goodbye', value: create(GoodbyeSchema, {reason, text})});
}

async function joinedPage(): Promise<Page> {
  const page = new Page();
  await welcome();
  assert.equal(page.all('joined').length, 1);
  return page;
}

test('it says Hello first, names what it takes, and joins', async () => {
  const page = new Page();
  assert.equal(browser.line.url, 'wss://scene.example/stream');
  assert.equal(browser.line.protocol, 'darm.2');
  assert.equal(browser.line.said.length, 0, 'nothing before the line is open');
  await welcome({viewPhystex: 512, chunksInView: 3});
  const [hello] = browser.line.said;
  assert.ok(hello?.case === 'hello' && hello.value.version === 2 && hello.value.chroma444 && !hello.value.pose);
  assert.deepEqual(page.last('joined').shape, {size: 64, viewSize: 512});
  page.session.camera(pose, 5000);
  const camera = browser.line.said.at(-1);
  assert.ok(camera?.case === 'camera' && camera.value.pose?.position?.z === 3 && camera.value.sequence === 1n);
  page.session.close();
});

test('a line that is cut is opened again, later each time, and never more than one at once', async () => {
  const page = await joinedPage();
  browser.line.cut();
  assert.deepEqual([page.last('out').reason, page.last('out').retryMs < 350], ['lost', true]);
  const waits = [];
  for (let i = 0; i < 8; ++i) {
    const before = browser.lines;
    const from = browser.now;
    while (browser.lines === before) await browser.pass(10);
    waits.push(browser.now - from);
    browser.line.cut();
    await browser.settle();
  }
  assert.ok(waits[3]! > 3 * waits[0]!, waits.join());
  for (const wait of waits) assert.ok(wait >= 250 && wait <= 5600, waits.join());
  const tries = browser.lines;
  await browser.pass(4000);
  assert.ok(browser.lines <= tries + 1);
  browser.fire('online');
  await browser.settle();
  const now = browser.lines;
  await welcome();
  browser.line.cut();
  assert.ok(page.last('out').retryMs < 350, 'once joined, a loss is a new one');
  browser.fire('online');
  assert.equal(browser.lines, now + 1, 'a network that is back is not waited for');
  page.session.close();
});

test('what is resumed is where the visitor is, and the scene is not sent twice', async () => {
  const page = await joinedPage();
  await manifest();
  page.session.camera(pose, 1);
  browser.line.cut();
  await browser.pass(400);
  browser.line.accept();
  const hello = browser.line.said[0];
  assert.ok(hello?.case === 'hello');
  assert.equal(hello.value.knownScene, 77n);
  assert.equal(hello.value.pose?.position?.x, 1);
  await welcome({sceneKnown: true});
  assert.equal(page.last('joined').sceneKnown, true);
  assert.equal(browser.line.said.at(-1)?.case, 'camera', 'the server is told again where that is');
  assert.equal(page.all('scene').length, 1);
  page.session.close();
});

test('a full server is asked again in ten seconds, and says so', async () => {
  const page = new Page();
  browser.line.accept();
  const before = browser.lines;
  goodbye(Goodbye_Reason.SERVER_FULL, 'full');
  assert.deepEqual([page.last('out').reason, page.last('out').retryMs], ['full', 10_000]);
  await browser.pass(9900);
  assert.equal(browser.lines, before);
  await browser.pass(200);
  assert.equal(browser.lines, before + 1);
  await welcome();
  assert.equal(page.all('joined').length, 1);
  page.session.close();
});

test('a server that sends away at once is not asked ever faster than one that is gone', async () => {
  const page = new Page();
  const before = browser.lines;
  for (let i = 0; i < 60; ++i) {
    if (browser.line.readyState === 0) {
      browser.line.accept();
      goodbye(Goodbye_Reason.SERVER_STOPS, 'The server stops.');
    }
    await browser.pass(1000);
  }
  assert.ok(browser.lines - before < 20, `${browser.lines - before} tries a minute`);
  page.session.close();
});

test('faults of the protocol end it for good, in words', async () => {
  const wrongs: [string, () => void, RegExp][] = [
    ['fault', () => browser.line.raw('text'), /sent a text/],
    ['fault', () => browser.line.raw(new Uint8Array([255, 255, 255]).buffer), /cannot be read/],
    ['fault', () => browser.line.say({case: 'frame', value: create(StreamFrameSchema, {frame: 1n, key: true})}),
      /contradicts itself: a frame of a stream/],
    ['fault', () => browser.line.say({case: 'coarse', value: create(CoarseTextureSchema, {})}), /before the manifest/],
    ['fault', () => browser.line.say({case: 'manifest', value: create(SceneManifestSchema, {})}), /contradicts itself/],
    ['version', () => goodbye(Goodbye_Reason.VERSION_UNSUPPORTED, 'Version 3 is spoken here.'), /Version 3/],
    ['refused', () => goodbye(Goodbye_Reason.FORMAT_REFUSED, 'No.'), /No/],
  ];
  for (const [reason, wrong, words] of wrongs) {
    const page = await joinedPage();
    wrong();
    await browser.settle();
    assert.equal(page.last('out').reason, reason);
    assert.match(page.last('out').text, words);
    assert.ok(page.last('out').retryMs < 0);
    assert.ok(browser.line.closed);
    const before = browser.lines;
    await browser.pass(60_000);
    browser.fire('online');
    page.session.resume();
    assert.equal(browser.lines, before, `${words}: not tried again`);
  }
});

test('a Welcome to something else than was asked for is refused', async () => {
  for (const more of [{version: 1}, {phystexSize: 4096}, {phystexSize: 63}, {viewPhystex: 4096}, {lossless: true}]) {
    const page = new Page();
    await welcome(more);
    assert.equal(page.last('out').reason, 'fault', JSON.stringify(more));
    assert.equal(page.all('joined').length, 0);
  }
});

test('silence is a loss; what is answered by pings is none', async () => {
  const page = await joinedPage();
  const {line} = browser;
  for (let i = 0; i < 10; ++i) {
    await browser.pass(4000);
    line.say({case: 'ping', value: create(PingSchema, {timeUs: 5n})});
  }
  assert.equal(page.all('out').length, 0);
  assert.equal(line.heard('pong'), 10);
  await browser.pass(8000);
  assert.ok(line.heard('ping') > 0, 'it asks before it gives up');
  assert.equal(page.all('out').length, 0);
  await browser.pass(6000);
  assert.equal(page.last('out').reason, 'lost');
  assert.ok(line.closed);
  page.session.close();
});

test('a page that slept has not listened: it asks before it takes the line for lost', async () => {
  const page = await joinedPage();
  const {line} = browser;
  await browser.sleep(120_000);
  await browser.pass(6100);
  assert.equal(page.all('out').length, 0);
  assert.ok(line.heard('ping') > 0);
  await browser.pass(8000);
  assert.equal(page.last('out').reason, 'lost', 'and then does');
  page.session.close();
});

test('a page that is put away says goodbye, keeps quiet, and goes on when it is back', async () => {
  const page = await joinedPage();
  await manifest();
  const {line} = browser;
  page.session.close();
  assert.equal(line.said.at(-1)?.case, 'goodbye');
  assert.ok(line.closed);
  const before = browser.lines;
  await browser.pass(60_000);
  browser.fire('online');
  assert.equal(browser.lines, before);
  page.session.resume();
  page.session.resume();
  assert.equal(browser.lines, before + 1);
  await welcome({sceneKnown: true});
  assert.equal(page.all('joined').length, 2);
  page.session.close();
});

test('one put away between two tries stays away', async () => {
  const page = await joinedPage();
  browser.line.cut();
  page.session.close();
  const before = browser.lines;
  await browser.pass(30_000);
  assert.equal(browser.lines, before);
});

test('why a line does not open is told as far as /healthz knows', async () => {
  const told: [typeof browser.health, string, RegExp][] = [
    [null, 'lost', /does not answer/],
    [{status: 502, body: '<html>Bad gateway'}, 'lost', /does not answer/],
    [{status: 503, body: '{"status":"stopping","protocol":2}'}, 'lost', /does not answer/],
    [{status: 200, body: '{"status":"ok","protocol":2}'}, 'lost', /must let WebSockets pass/],
    [{status: 200, body: '{"status":"ok","protocol":3}'}, 'version', /speaks version 3, this page 2/],
  ];
  for (const [health, reason, words] of told) {
    browser.health = health;
    const page = new Page();
    browser.line.cut();
    await browser.settle();
    assert.equal(page.all('out').length, 1);
    assert.equal(page.last('out').reason, reason);
    assert.match(page.last('out').text, words);
    page.session.close();
  }
  browser.health = null;
});

test('a line that opens neither nor fails is given up', async () => {
  const page = new Page();
  const before = browser.lines;
  await browser.pass(13_000);
  assert.equal(page.last('out').reason, 'lost');
  await browser.pass(1000);
  assert.equal(browser.lines, before + 1);
  page.session.close();
});

test('a CoarseTex whose decoder is taken away once is decoded again; twice is said', async () => {
  let losses = 1;
  class Decoder {
    state = 'configured';
    constructor(private readonly to: {output: (frame: unknown) => void; error: (error: Error) => void}) {}
    configure(): void {}
    close(): void {}
    flush = async (): Promise<void> => {};
    decode({timestamp}: {timestamp: number}): void {
      if (losses-- > 0) return this.to.error(new Error('reclaimed'));
      this.to.output({timestamp, format: 'I420', visibleRect: {width: 30, height: 30}, close: () => {}, copyTo: async () => []});
    }
  }
  Object.assign(globalThis, {VideoDecoder: Decoder, EncodedVideoChunk: class {
    constructor(init: object) {
      Object.assign(this, init);
    }
  }});
  const page = await joinedPage();
  await manifest();
  const h264 = new Uint8Array([0, 0, 0, 1, 0x67, 0x64, 0x00, 0x32, 1]);
  const coarse = {case: 'coarse', value: create(CoarseTextureSchema, {width: 30, height: 30, version: 1, h264})} as const;
  browser.line.say(coarse);
  await browser.settle();
  assert.equal(page.all('coarse').length, 1);
  assert.equal(page.all('out').length, 0);
  losses = 2;
  browser.line.say(coarse);
  await browser.settle();
  assert.equal(page.last('out').reason, 'fault');
});
