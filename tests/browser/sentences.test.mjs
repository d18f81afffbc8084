// What does not work is said in one sentence with the way out; what was lost comes back by itself.
import assert from 'node:assert/strict';
import {writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';

import {browse, folder, serve, status, until} from './running.mjs';

const state = folder();
let browser;

before(async () => {
  browser = await browse({flags: ['--host-resolver-rules=MAP darm.test 127.0.0.1']});
});
after(async () => {
  await browser?.close();
  state.remove();
});

const small = {viewport: {width: 320, height: 180}};

test('outside of a secure context the way to HTTPS is shown, with the view', async () => {
  const daemon = await serve(state.path, {more: ['--q', '16']});
  const context = await browser.newContext({...small, ignoreHTTPSErrors: true});
  const page = await context.newPage();
  await page.goto(`http://darm.test:${daemon.web}/#view=1,2,0,30,0,60`);
  const alert = page.getByRole('alert');
  await alert.waitFor();
  assert.match(await alert.innerText(), /secure connection only: open this page by HTTPS/);
  await alert.getByRole('link').click();
  await page.waitForURL(`https://darm.test:${daemon.web}/#view=1,2,0,30,0,60`);
  await until(page, (s) => s.firstPictureMs !== null, 30, 'a picture behind the way out');
  await context.close();
  await daemon.stop();
});

// What moves in a scene, or shows something of it.
const kHands = ['scene', 'mode', 'share', 'show-panel', 'show-help'];

// Neither by a hand nor, going round once, by the keyboard.
async function nothingToPress(page) {
  for (let i = 0; i < 8; ++i) {
    await page.keyboard.press('Tab');
    const id = await page.evaluate(() => document.activeElement?.id);
    assert.ok(!kHands.includes(id), `${id} does nothing here`);
  }
  for (const id of kHands.slice(1)) assert.ok(await page.locator(`#${id}`).isHidden(), id);
}

test('a server without HTTPS offers none, but says how to get in', async () => {
  const config = join(state.path, 'no_tls.toml');
  writeFileSync(config, '[tls]\nenabled = false\n');
  const daemon = await serve(state.path, {more: ['--q', '16', '--config', config]});
  const context = await browser.newContext(small);
  const page = await context.newPage();
  await page.goto(`http://darm.test:${daemon.web}/`);
  const alert = page.getByRole('alert');
  await alert.waitFor();
  assert.match(await alert.innerText(), new RegExp(`no HTTPS: open http://localhost:${daemon.web}/ on its own machine`));
  assert.equal(await page.getByRole('link').count(), 0);
  await page.setViewportSize({width: 240, height: 120});
  const {y, height} = await alert.boundingBox();
  assert.ok(y >= 0 && y + height <= 120, 'where it does not fit it scrolls');
  await nothingToPress(page);
  await context.close();
  await daemon.stop();
});

/** What a page says that runs `script` first and then cannot show the scene. */
async function alertWith(script) {
  const daemon = await serve(state.path, {more: ['--q', '16']});
  const context = await browser.newContext(small);
  const page = await context.newPage();
  await page.addInitScript(script);
  await page.goto(`http://127.0.0.1:${daemon.web}/`);
  const alert = page.getByRole('alert');
  await alert.waitFor();
  const text = await alert.innerText();
  await nothingToPress(page);
  await context.close();
  await daemon.stop();
  return text;
}

test('without WebGL 2 the way out is named', async () => {
  const text = await alertWith(() => {
    const real = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
      return kind === 'webgl2' ? null : real.call(this, kind, ...more);
    };
  });
  assert.match(text, /no WebGL 2.*turn on hardware acceleration/);
});

test('a scene that cannot be drawn is said, and leaves no buttons that do nothing', async () => {
  const text = await alertWith(() => {
    // A driver that takes no shader.
    const real = WebGL2RenderingContext.prototype.shaderSource;
    WebGL2RenderingContext.prototype.shaderSource = function (shader) {
      real.call(this, shader, 'no shader');
    };
  });
  assert.match(text, /cannot be drawn here.*another browser/);
});

test('a full server says so, and lets in who waits', async () => {
  const config = join(state.path, 'one.toml');
  writeFileSync(config, '[session]\nmax_sessions = 1\n');
  const daemon = await serve(state.path, {more: ['--q', '16', '--config', config]});
  const context = await browser.newContext(small);
  const first = await context.newPage();
  await first.goto(`http://127.0.0.1:${daemon.web}/`);
  await until(first, (s) => s.joined, 30, 'the first joined');
  const second = await context.newPage();
  await second.goto(`http://127.0.0.1:${daemon.web}/`);
  const alert = second.getByRole('alert');
  await alert.waitFor();
  assert.match(await alert.innerText(), /as many visitors as it may have.*tried again in 10 s/);
  await first.close();
  await until(second, (s) => s.joined, 30, 'the second joined by itself');
  assert.ok(await alert.isHidden());
  await context.close();
  await daemon.stop();
});

test('the server dies: the picture stays and moves, a quiet notice comes, the stream goes on without reload', async (t) => {
  let daemon = await serve(state.path, {more: ['--q', '16']});
  const context = await browser.newContext(small);
  const page = await context.newPage();
  await page.goto(`http://127.0.0.1:${daemon.web}/`);
  await until(page, (s) => s.firstPictureMs !== null && s.streamFrames > 0 && s.finest, 30, 'a picture');
  await page.evaluate(() => (globalThis.notReloaded = true));
  const port = daemon.web;
  await daemon.stop('SIGKILL');
  const notice = page.locator('#notice');
  await page.waitForFunction(() => /Connection lost; the picture stays/.test(document.getElementById('notice').textContent));
  assert.ok(await notice.isVisible());
  const before = await status(page);
  await page.keyboard.down('KeyW');
  await page.waitForTimeout(400);
  await page.keyboard.up('KeyW');
  await until(page, (s) => s.framesDrawn > before.framesDrawn + 1, 10, 'frames without a server');
  const alone = await status(page);
  assert.notDeepEqual(alone.view.position, before.view.position);
  assert.equal(alone.streamFrames, before.streamFrames);
  daemon = await serve(state.path, {port, more: ['--q', '16']});
  const back = await until(page, (s) => s.joins === 2 && s.streamFrames > alone.streamFrames, 30, 'the stream again');
  assert.ok(await page.evaluate(() => globalThis.notReloaded === true));
  const strayed = Math.hypot(...back.view.position.map((p, i) => p - alone.view.position[i]));
  assert.ok(strayed < 0.1, `it is where the visitor went: ${strayed} m away`);
  t.diagnostic(`${before.received} bytes until the loss, ${back.received - alone.received} to be back`);
  await page.waitForFunction(() => document.getElementById('notice').hidden, undefined, {timeout: 10_000});
  await context.close();
  await daemon.stop();
});
