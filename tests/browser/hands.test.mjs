// What hands do: gamepads, keys pressed too early or after a button, and speeds that suit the scene.
import assert from 'node:assert/strict';
import {writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';

import {boxScene, close, folder, lagging, open, picture, serve, status, until} from './running.mjs';

const state = folder();
let daemon;
let browser;

before(async () => ({daemon, browser} = await open(state, '--q', '16')));
after(() => close(state, daemon, browser));

const small = {viewport: {width: 320, height: 180}};
const distance = (a, b) => Math.hypot(...a.position.map((p, i) => p - b.position[i]));

async function visit(port = daemon.web, options = small) {
  const page = await (await browser.newContext(options)).newPage();
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  await page.goto(`http://127.0.0.1:${port}/`);
  return {page, faults};
}

async function inside(port, options) {
  const visited = await visit(port, options);
  await until(visited.page, (s) => s.firstPictureMs !== null, 60, 'a picture');
  return visited;
}

// A gamepad as browsers show them, whose sticks a test moves: `pads` is what is plugged in.
async function plugIn(page) {
  await page.evaluate(() => {
    const button = () => ({pressed: false, touched: false, value: 0});
    globalThis.pad = {id: 'test', index: 1, connected: true, mapping: 'standard', timestamp: 0, axes: [0, 0, 0, 0],
      buttons: Array.from({length: 17}, button)};
    globalThis.pads = [null, globalThis.pad, null, null];
    Object.defineProperty(navigator, 'getGamepads', {value: () => globalThis.pads, configurable: true});
    dispatchEvent(new Event('gamepadconnected'));
  });
}

const push = (page, axes, triggers = [0, 0]) => page.evaluate(([sticks, [down, up]]) => {
  globalThis.pad.axes = sticks;
  globalThis.pad.buttons[6].value = down;
  globalThis.pad.buttons[7].value = up;
}, [axes, triggers]);

const rest = async (page) => {
  let view = null;
  for (;;) {
    const now = (await status(page)).view;
    if (view !== null && JSON.stringify(view) === JSON.stringify(now)) return now;
    view = now;
    await page.waitForTimeout(400);
  }
};

// The views before and after sticks are held until `moved(from, now)`, and at rest again: pictures may be slow.
async function hold(page, axes, triggers, moved) {
  const from = await rest(page);
  await push(page, axes, triggers);
  await until(page, (s) => moved(from, s.view), 30, 'the sticks move it');
  await push(page, [0, 0, 0, 0]);
  return {from, to: await rest(page)};
}

async function holdKey(page, key, moved) {
  const from = await rest(page);
  await page.keyboard.down(key);
  await until(page, (s) => moved(from, s.view), 30, `${key} moves it`);
  await page.keyboard.up(key);
  return {from, to: await rest(page)};
}

test('a gamepad walks by its left stick, looks by its right one, and rises by its triggers', async () => {
  const {page, faults} = await inside();
  await plugIn(page);
  const walk = await hold(page, [0, -1, 0, 0], [0, 0], (from, now) => distance(from, now) > 0.2);
  const ahead = [-Math.sin(walk.from.yaw), 0, -Math.cos(walk.from.yaw)];
  const way = walk.to.position.map((p, i) => p - walk.from.position[i]);
  const along = way.reduce((sum, v, i) => sum + v * ahead[i], 0);
  assert.ok(along > 0.999 * Math.hypot(...way), `ahead, and level: ${way}`);
  assert.equal(walk.to.yaw, walk.from.yaw);
  // By less than a turn: to the right is down in yaw.
  const look = await hold(page, [0, 0, 0.3, -0.3], [0, 0], (from, now) => now.yaw < from.yaw - 0.02);
  assert.ok(look.to.pitch > look.from.pitch, 'a stick pushed away looks up');
  assert.ok(distance(look.from, look.to) < 1e-9);
  const rise = await hold(page, [0, 0, 0, 0], [0, 1], (from, now) => now.position[1] > from.position[1] + 0.1);
  assert.ok(Math.hypot(rise.to.position[0] - rise.from.position[0], rise.to.position[2] - rise.from.position[2]) < 1e-9);
  const still = await rest(page);
  await push(page, [0.1, -0.1, 0.12, NaN]);
  await page.waitForTimeout(600);
  assert.deepEqual((await status(page)).view, still, 'a stick that wobbles, or tells no number, does nothing');
  assert.deepEqual(faults, []);
  await page.context().close();
});

test('a gamepad that is pulled out while its stick is pushed stops the walk, and is no fault', async () => {
  const {page, faults} = await inside();
  await plugIn(page);
  const from = (await status(page)).view;
  await push(page, [0, -1, 0, 0]);
  await until(page, (s) => distance(from, s.view) > 0.1, 30, 'it walks');
  await page.evaluate(() => {
    globalThis.pads = [null, null, null, null];
    dispatchEvent(new Event('gamepaddisconnected'));
  });
  const stopped = await rest(page);
  await page.evaluate(() => (globalThis.pads = [null, {...globalThis.pad, mapping: '', axes: [1, 1, 1, 1, 9]}]));
  await page.waitForTimeout(300);
  assert.deepEqual((await status(page)).view, stopped, 'nor does one whose sticks nobody knows move it');
  assert.deepEqual(faults, []);
  await page.context().close();
});

test('whoever cannot wait and presses keys before the scene is there begins where it begins', async () => {
  const {page: patient} = await inside();
  const start = (await status(patient)).view;
  await patient.context().close();
  const slow = await lagging(daemon.web, 1000);
  const {page} = await visit(slow.port);
  await page.waitForFunction(() => globalThis.darm);
  assert.equal((await status(page)).joins, 0);
  await page.keyboard.press('KeyW');
  await until(page, (s) => s.joined, 30, 'joined');
  await page.waitForTimeout(300);
  assert.ok(distance((await status(page)).view, start) < 0.5);
  await page.context().close();
  slow.close();
});

test('keys go on walking after a button was pressed; R and F look up and down', async () => {
  const {page} = await inside();
  await page.getByRole('button', {name: 'Numbers'}).click();
  await holdKey(page, 'KeyW', (from, now) => distance(from, now) > 0.1);
  await holdKey(page, 'KeyR', (from, now) => now.pitch > from.pitch + 0.05);
  await holdKey(page, 'KeyF', (from, now) => now.pitch < from.pitch - 0.05);
  await page.context().close();
});

// Metres a second while W is held: of the steps between pictures, the middle one.
async function walkingSpeed(page) {
  await page.evaluate(() => {
    const steps = (globalThis.steps = []);
    let before = null;
    const look = (at) => {
      const {position} = globalThis.darm.status().view;
      if (before !== null) {
        const way = Math.hypot(...position.map((p, i) => p - before.position[i]));
        if (way > 0) steps.push((way * 1000) / (at - before.at));
      }
      before = {at, position};
      if (steps.length < 1000) requestAnimationFrame(look);
    };
    requestAnimationFrame(look);
  });
  await page.keyboard.down('KeyW');
  await page.waitForFunction(() => globalThis.steps.length >= 20, undefined, {timeout: 60_000});
  const steps = await page.evaluate(() => globalThis.steps.slice(0, 20).sort((a, b) => a - b));
  await page.keyboard.up('KeyW');
  return steps[10];
}

// The share of the diagonal in a second that walkSpeed promises, with room for steps cut short on a slow machine.
for (const [size, least, most] of [[0.007, 0.03, 0.12], [3000, 0.002, 0.007]]) {
  test(`a scene of ${size} m is walked at a sane speed, and is seen`, async (t) => {
    const path = join(state.path, `box${size}.gltf`);
    const config = join(state.path, `box${size}.toml`);
    boxScene(path, size);
    writeFileSync(config, '');
    const box = await serve(join(state.path, `box${size}`), {config, more: ['--scene', path]});
    const {page, faults} = await inside(box.web);
    await until(page, (s) => s.streamFrames > 0 && s.finest, 60, 'light');
    const diagonal = size * Math.sqrt(3);
    const levels = new Set((await picture(page)).data);
    assert.ok(levels.size > 20, 'something is to be seen');
    const share = await walkingSpeed(page) / diagonal;
    t.diagnostic(`${(share * 100).toFixed(2)} % of the diagonal in a second`);
    assert.ok(share > least && share < most, String(share));
    const from = await rest(page);
    await page.mouse.move(160, 90);
    for (let i = 0; i < 10; ++i) await page.mouse.wheel(0, -120);
    const way = distance(from, await rest(page)) / diagonal;
    assert.ok(way > 0 && way < 1, `ten steps of the wheel: ${way} of the diagonal`);
    assert.deepEqual(faults, []);
    await page.context().close();
    await box.stop();
  });
}
