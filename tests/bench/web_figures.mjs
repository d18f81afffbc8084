// What the web client costs here, and what it looks like: the web rows and pictures of docs/devices.md. It opens the page
// on a named camera in a browser without a screen, lets light settle, takes a screenshot, then turns the view.
//   node tests/bench/web_figures.mjs --camera hall [--config SET-UP] [--scene FILE] [--size 1280x720] [--light S]
//        [--turn S] [--panel] [--out PICTURE.png] [--state-dir D]
// One line of JSON: frames_per_second, and p50, p99, count of draw_ms, decode_ms and upload_ms over the turn.
// DARM_BUILD (build/release) is the build folder, with the web client's packages in it.
import {dirname, join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';
import {parseArgs} from 'node:util';

const source = resolve(dirname(fileURLToPath(import.meta.url)), '../..');
const build = resolve(process.env.DARM_BUILD ?? join(source, 'build/release'));
process.env.DARM_SOURCE ??= source;
process.env.DARM_BIN ??= join(build, 'bin');
process.env.DARM_WEB ??= join(build, 'client/web');
process.env.DARM_CHROMIUM ??= '/usr/bin/chromium';

const {browse, folder, linkOf, serve, until} = await import('../browser/running.mjs');

const {values: options} = parseArgs({options: {
  camera: {type: 'string', default: 'hall'}, config: {type: 'string'}, scene: {type: 'string'},
  size: {type: 'string', default: '1280x720'}, light: {type: 'string', default: '25'},
  turn: {type: 'string', default: '10'}, panel: {type: 'boolean', default: false}, out: {type: 'string'},
  'state-dir': {type: 'string'}}});
const [width, height] = options.size.split('x').map(Number);
const config = resolve(options.config ?? join(source, 'config/scenes/default.toml'));

// The figures of each picture and of each frame of the stream while ArrowLeft is held.
function watch(seconds) {
  return new Promise((done) => {
    const status = () => globalThis.darm.status();
    const from = performance.now();
    const first = status();
    const seen = {draw: [], decode: [], upload: [], level: 0};
    let {framesDrawn, streamFrames} = first;
    const look = () => {
      const now = status();
      if (now.framesDrawn !== framesDrawn) seen.draw.push(now.cost.drawMs);
      if (now.streamFrames !== streamFrames) {
        seen.decode.push(now.cost.decodeMs);
        seen.upload.push(now.cost.uploadMs);
      }
      ({framesDrawn, streamFrames} = now);
      seen.level = Math.max(seen.level, now.cost.level);
      const elapsed = (performance.now() - from) / 1000;
      if (elapsed < seconds) requestAnimationFrame(look);
      else done({...seen, framesPerSecond: (now.framesDrawn - first.framesDrawn) / elapsed});
    };
    requestAnimationFrame(look);
  });
}

function spread(values) {
  const sorted = [...values].sort((a, b) => a - b);
  const at = (q) => (sorted.length === 0 ? null : sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))]);
  return {p50: at(0.5), p99: at(0.99), count: sorted.length};
}

async function measure(page, seconds) {
  await page.keyboard.down('ArrowLeft');
  await page.waitForTimeout(3000);  // the frame-rate guard finds its level
  const seen = await page.evaluate(watch, seconds);
  await page.keyboard.up('ArrowLeft');
  return {frames_per_second: seen.framesPerSecond, guard_level: seen.level, draw_ms: spread(seen.draw),
    decode_ms: spread(seen.decode), upload_ms: spread(seen.upload)};
}

const own = folder();
const state = options['state-dir'] ?? own.path;
const daemon = await serve(state, {config, more: options.scene ? ['--scene', resolve(options.scene)] : []});
const browser = await browse();
try {
  const page = await (await browser.newContext({viewport: {width, height}})).newPage();
  await page.goto(`http://127.0.0.1:${daemon.web}/${linkOf(options.camera, config)}`);
  const first = await until(page, (s) => s.firstPictureMs !== null, 60, 'a picture');
  if (options.panel) await page.keyboard.press('KeyP');
  await page.waitForTimeout(Number(options.light) * 1000);
  const settled = await until(page, (s) => s.finest, 20, 'a picture at its finest');
  if (options.out) await page.screenshot({path: options.out, type: 'png'});
  const turned = Number(options.turn) > 0 ? await measure(page, Number(options.turn)) : {};
  console.log(JSON.stringify({camera: options.camera, size: options.size, first_picture_ms: first.firstPictureMs,
    first_picture_bytes: first.bytesToFirstPicture, error: settled.error, lag_ms: settled.lagMs,
    finest_draw_ms: settled.cost.drawMs, ...turned}));
} finally {
  await browser.close();
  await daemon.stop();
  own.remove();
}
