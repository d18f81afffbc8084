import assert from 'node:assert/strict';
import {test} from 'node:test';

import {Goodbye_Reason} from '../src/gen/darm_pb.js';
import {axisOf} from '../src/page/input.js';
import {lines} from '../src/page/panel.js';
import {residencyOf} from '../src/page/residency.js';
import {whatIsMissing} from '../src/page/requirements.js';
import {secureWay} from '../src/page/secure_way.js';
import {meaningOf, retryDelay} from '../src/worker/stream_socket.js';
import {codecOf, splitChroma} from '../src/worker/video_decoder.js';

test('what is missing is said with the way out', () => {
  const all = {secure: true, webCodecs: true, webGl2: true, webAssembly: true, href: 'http://host:9080/#view=1,2,3,4,5,60',
    httpsPort: 9080};
  assert.equal(whatIsMissing(all), null);
  const insecure = whatIsMissing({...all, secure: false, webCodecs: false});
  assert.equal(insecure?.link?.href, 'https://host:9080/#view=1,2,3,4,5,60', 'the view is kept');
  assert.match(whatIsMissing({...all, webCodecs: false})!.text, /WebCodecs.*use a current/);
  assert.match(whatIsMissing({...all, webGl2: false})!.text, /WebGL 2.*hardware acceleration/);
  assert.match(whatIsMissing({...all, webAssembly: false})!.text, /WebAssembly.*allow it/);
});

test('HTTPS is offered where it is, and nowhere else', () => {
  assert.equal(secureWay('http://host/#view=1,2,3,4,5,60', 80).link?.href, 'https://host:80/#view=1,2,3,4,5,60');
  const without = secureWay('http://host:9080/', 0);
  assert.equal(without.link, undefined);
  assert.match(without.text, /no HTTPS: open http:\/\/localhost:9080\/ on its own machine.*tls\.enabled.*reverse proxy/);
  for (const port of [9080, null]) {
    const between = secureWay('http://scene.example/', port);
    assert.equal(between.link, undefined, 'what stands between page and server need not speak it');
    assert.match(between.text, /ask who runs this server for its HTTPS address/);
  }
});

test('a goodbye says whether to come again', () => {
  const full = meaningOf(Goodbye_Reason.SERVER_FULL, '');
  assert.deepEqual([full.reason, full.retryMs > 0], ['full', true]);
  assert.ok(meaningOf(Goodbye_Reason.VERSION_UNSUPPORTED, 'x').retryMs < 0);
  assert.equal(meaningOf(Goodbye_Reason.SERVER_STOPS, 'The server stops.').reason, 'lost');
});

test('tries grow rarer, but not beyond a few seconds', () => {
  assert.ok(retryDelay(0, 0) < 350);
  for (let n = 0; n < 100; ++n) assert.ok(retryDelay(n, 1) <= 5500);
  assert.ok(retryDelay(3, 0.5) > retryDelay(2, 0.5));
});

test('the codec is read from the parameter set', () => {
  assert.equal(codecOf(new Uint8Array([0, 0, 0, 1, 9, 16, 0, 0, 1, 0x67, 0x64, 0x00, 0x32, 1])), 'avc1.640032');
  assert.equal(codecOf(new Uint8Array([0, 0, 0, 1, 0x65, 0x88, 1, 2, 3, 4])), null);
  assert.equal(codecOf(new Uint8Array()), null);
});

test('interleaved chroma is parted', () => {
  const cb = new Uint8Array(2);
  const cr = new Uint8Array(2);
  splitChroma(new Uint8Array([1, 2, 3, 4]), cb, cr);
  assert.deepEqual([[...cb], [...cr]], [[1, 3], [2, 4]]);
});

test('classes of samples are counted over surfaces alone', () => {
  const rgba = new Uint8Array([32, 0, 0, 255, 64, 0, 0, 255, 96, 0, 0, 255, 128, 0, 0, 255, 0, 0, 0, 255]);
  const r = residencyOf(rgba);
  assert.deepEqual([r.sharp, r.coarser, r.coarseTex, r.undefined], [0.25, 0.25, 0.25, 0.25]);
});

test('a stick at rest stays at rest', () => {
  for (const value of [0.1, -0.14, NaN, undefined]) assert.equal(Math.abs(axisOf(value)), 0, String(value));
  assert.equal(axisOf(1), 1);
  assert.equal(axisOf(-1), -1);
});

test('the panel tells numbers with their units', () => {
  const said = lines({framesPerSecond: 58.6, drawMs: 4, level: 0, bitsPerSecond: 1.62e6, lagMs: 132.4, error: 0.01, resolutionError: 0.1, omittedError: 0.05,
    lagStages: {network: 41, wait: 40, visibility: 10, shading: 1, encode: 20.2, queue: 0.1, decode: 8, display: 12.1},
    traffic: {received: 3.2e6, stream: 2e6, geometry: 1e6, coarse: 1e5, decodeMs: 6.2, framesLost: 0}, seconds: 100,
    residency: {sharp: 0.9, coarser: 0.06, coarseTex: 0.03, undefined: 0.01}});
  assert.equal(said['stream'], '1.6 Mbit/s');
  assert.equal(said['lag'], '132 ms: network 41, wait 40, visibility 10, shading 1, encode 20, queue 0, decode 8, display 12');
  assert.equal(said['fallback'], '10 %');
  assert.equal(said['error'], '2.55 of 255 (40.0 dB)');
  assert.equal(said['resolution'], '25.50 of 255 (20.0 dB)');
  assert.equal(said['omitted'], '12.75 of 255 (26.0 dB)');
  assert.match(said['cost']!, /^3\.2 MB \(115\.2 MB an hour\)/);
});
