// Starts the real daemon and a real browser for the tests of the web client.
import assert from 'node:assert/strict';
import {execFile, execFileSync, spawn} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {createServer, connect} from 'node:net';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after} from 'node:test';
import {createInterface} from 'node:readline';

const require = createRequire(join(process.env.DARM_WEB, 'package.json'));
const {chromium} = require('playwright-core');
const {PNG} = require('pngjs');

export const source = process.env.DARM_SOURCE;
export const setUp = join(source, 'config/scenes/default.toml');

const kFlags = ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--disable-sync'];

// Daemons that a failed test has left: they would keep this process waiting. A bench has no test to come after.
const left = new Set();
const killThem = () => left.forEach((child) => child.kill('SIGKILL'));
if (process.env.NODE_TEST_CONTEXT) after(killThem);
else process.on('exit', killThem);

export function folder() {
  const path = mkdtempSync(join(tmpdir(), 'darm-browser-'));
  return {path, remove: () => rmSync(path, {recursive: true, force: true})};
}

export function browse({flags = [], ...more} = {}) {
  return chromium.launch({executablePath: process.env.DARM_CHROMIUM, headless: true, args: [...kFlags, ...flags], ...more});
}

/** darmd serve, on the default scene if no other is named; `web` is its port. */
export async function serve(state, {port = 0, config = setUp, more = []} = {}) {
  const child = spawn(join(process.env.DARM_BIN, 'darmd'),
    ['serve', '--config', config, '--state-dir', state, '--address', '127.0.0.1', '--tcp-port', '0', '--udp-port', '0',
      '--metrics-port', '-1', '--http-port', String(port), ...more], {stdio: ['ignore', 'pipe', 'pipe']});
  left.add(child);
  let log = '';
  child.stderr.on('data', (data) => (log += data));
  const ended = new Promise((resolve) => child.once('exit', () => {
    left.delete(child);
    resolve();
  }));
  const first = await Promise.race([
    new Promise((resolve) => createInterface({input: child.stdout}).once('line', resolve)),
    ended.then(() => '')]);
  const found = /ready: tcp 127\.0\.0\.1:(\d+).* web http:\/\/127\.0\.0\.1:(\d+)\//.exec(first);
  assert.ok(found, `no ready line but: ${first}${log}`);
  return {
    tcp: Number(found[1]), web: Number(found[2]), log: () => log,
    stop: async (signal = 'SIGTERM') => {
      child.kill(signal);
      await ended;
    },
  };
}

/** A daemon and a browser for all tests of a file, with a folder of their own. */
export async function open(state, ...more) {
  return {daemon: await serve(state.path, {more}), browser: await browse()};
}

export async function close(state, daemon, browser) {
  await browser?.close();
  await daemon?.stop();
  state.remove();
}

export const status = (page) => page.evaluate(() => globalThis.darm?.status() ?? null);

/** Waits until `holds(status)`; the last status. */
export async function until(page, holds, seconds, what) {
  const end = Date.now() + seconds * 1000;
  for (;;) {
    const now = await status(page);
    if (now !== null && holds(now)) return now;
    assert.ok(Date.now() < end, `in ${seconds} s not: ${what}; ${JSON.stringify(now)}`);
    await page.waitForTimeout(30);
  }
}

/** The page's pixels: {width, height, data: RGBA}. */
export async function picture(page) {
  return PNG.sync.read(await page.screenshot({type: 'png'}));
}

export function difference(a, b) {
  let sum = 0;
  for (let i = 0; i < a.data.length; ++i) sum += Math.abs(a.data[i] - b.data[i]);
  return sum / a.data.length;
}

// PFM: "PF", width height, -1.0 (little-endian), rows from the bottom.
function readPfm(path) {
  const bytes = readFileSync(path);
  const head = /^PF\s+(\d+)\s+(\d+)\s+(-[\d.]+)\n/.exec(bytes.subarray(0, 64).toString('latin1'));
  assert.ok(head, `${path} is no little-endian colour PFM`);
  const [width, height] = [Number(head[1]), Number(head[2])];
  const raw = bytes.subarray(head[0].length);
  const values = new Float32Array(raw.buffer.slice(raw.byteOffset, raw.byteOffset + width * height * 12));
  return {width, height, at: (x, y, c) => values[((height - 1 - y) * width + x) * 3 + c]};
}

// Linear, display-referred (1 is white) to what a screen is sent.
function display(linear) {
  const c = Math.min(1, Math.max(0, linear));
  return c <= 0.0031308 ? c * 12.92 : 1.055 * c ** (1 / 2.4) - 0.055;
}

/** PSNR of a screenshot against the two independent halves of a reference (DESIGN section 4): their noise cancels. */
export function psnr(shot, reference) {
  const [a, b] = ['a', 'b'].map((half) => readPfm(reference.replace(/\.png$/, `.${half}.pfm`)));
  assert.deepEqual([shot.width, shot.height], [a.width, a.height]);
  let sum = 0;
  for (let y = 0; y < a.height; ++y) {
    for (let x = 0; x < a.width; ++x) {
      for (let c = 0; c < 3; ++c) {
        const value = shot.data[(y * a.width + x) * 4 + c] / 255;
        sum += (value - display(a.at(x, y, c))) * (value - display(b.at(x, y, c)));
      }
    }
  }
  return -10 * Math.log10(Math.max(sum / (a.width * a.height * 3), 1e-12));
}

export function render(state, camera, size, spp, name = 'reference') {
  const out = join(state, `${name}.png`);
  execFileSync(join(process.env.DARM_BIN, 'darmd'), ['render', '--config', setUp, '--camera', camera, '--size', size,
    '--spp', String(spp), '--state-dir', state, '--out', out], {stdio: ['ignore', 'ignore', 'pipe']});
  return out;
}

/** The native client's report on the same daemon, once it has looked for `seconds`. */
export function probe(port, camera, size, seconds, reference, state) {
  const arguments_ = ['--server', `127.0.0.1:${port}`, '--setup', setUp,
    '--camera', camera, '--size', size, '--seconds', String(seconds), '--reference', reference.replace(/\.png$/, '.pfm'),
    '--out', join(state, 'probe.png'), '--json'];
  return new Promise((resolve, reject) => {
    execFile(join(process.env.DARM_BIN, 'darm-probe'), arguments_, (error, out) => (error ? reject(error) : resolve(JSON.parse(out))));
  });
}

/** The link of a named camera of a set-up. */
export function linkOf(camera, config = setUp) {
  const text = readFileSync(config, 'utf8');
  const block = text.split('[[cameras]]').find((part) => part.includes(`name = "${camera}"`));
  const vector = (key) => new RegExp(`${key} = \\[([^\\]]*)\\]`).exec(block)[1].split(',').map(Number);
  const fovy = Number(/fovy = ([\d.]+)/.exec(block)[1]);
  const [p, t] = [vector('position'), vector('target')];
  const [x, y, z] = t.map((v, i) => v - p[i]);
  const degrees = (angle) => (angle * 180) / Math.PI;
  return `#view=${[...p, degrees(Math.atan2(-x, -z)), degrees(Math.atan2(y, Math.hypot(x, z))), fovy]
    .map((v) => Number(v.toPrecision(9))).join(',')}`;
}

/** Passes bytes on to `port`, each way `delay` milliseconds late. Its own port is `port`. */
export async function lagging(port, delay) {
  const server = createServer((near) => {
    const far = connect(port, '127.0.0.1');
    for (const [from, to] of [[near, far], [far, near]]) {
      from.on('data', (data) => setTimeout(() => to.writable && to.write(data), delay));
      from.on('end', () => setTimeout(() => to.end(), delay));
      from.on('error', () => to.destroy());
    }
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return {port: server.address().port, close: () => server.close()};
}

/** Passes bytes on to `port`, until they are cut(): all lines at once, without a word. */
export async function cutting(port) {
  const ends = new Set();
  const server = createServer((near) => {
    const far = connect(port, '127.0.0.1');
    for (const [from, to] of [[near, far], [far, near]]) {
      ends.add(from);
      from.pipe(to);
      from.on('error', () => to.destroy());
      from.on('close', () => ends.delete(from));
    }
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  const cut = () => ends.forEach((end) => end.destroy());
  return {port: server.address().port, cut, close: () => {
    server.close();
    cut();
  }};
}

/** A glTF file of a yard: a cube without its top, edges of `size` metres, each side of another colour, no lights. */
export function boxScene(path, size) {
  const sides = [[0, 0], [0, 1], [1, 0], [2, 0], [2, 1]];
  const positions = new Float32Array(sides.length * 12);
  sides.forEach(([axis, side], i) => [[0, 0], [1, 0], [0, 1], [1, 1]].forEach(([a, b], corner) => {
    const place = [0, 0, 0];
    place[axis] = side;
    place[(axis + 1) % 3] = a;
    place[(axis + 2) % 3] = b;
    positions.set(place.map((v) => v * size), i * 12 + corner * 3);
  }));
  const indices = new Uint16Array([0, 1, 2, 2, 1, 3]);
  const bytes = Buffer.concat([Buffer.from(positions.buffer), Buffer.from(indices.buffer)]);
  const colours = [[0.8, 0.2, 0.2], [0.2, 0.8, 0.2], [0.7, 0.7, 0.7], [0.2, 0.2, 0.8], [0.8, 0.8, 0.2]];
  writeFileSync(path, JSON.stringify({
    asset: {version: '2.0'}, scene: 0, scenes: [{nodes: [0]}], nodes: [{mesh: 0}],
    meshes: [{primitives: sides.map((_, i) => ({attributes: {POSITION: i}, indices: sides.length, material: i}))}],
    materials: colours.map((c) => ({doubleSided: true, pbrMetallicRoughness: {baseColorFactor: [...c, 1], metallicFactor: 0}})),
    accessors: [...sides.map((_, i) => {
      const points = [0, 1, 2, 3].map((corner) => [...positions.subarray(i * 12 + corner * 3, i * 12 + corner * 3 + 3)]);
      return {bufferView: 0, byteOffset: i * 48, componentType: 5126, count: 4, type: 'VEC3',
        min: [0, 1, 2].map((axis) => Math.min(...points.map((p) => p[axis]))),
        max: [0, 1, 2].map((axis) => Math.max(...points.map((p) => p[axis])))};
    }), {bufferView: 1, componentType: 5123, count: 6, type: 'SCALAR'}],
    bufferViews: [{buffer: 0, byteLength: positions.byteLength},
      {buffer: 0, byteOffset: positions.byteLength, byteLength: indices.byteLength}],
    buffers: [{byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}`}],
  }));
}
