// Keys, gestures and small screens: the help sheet, the panel under the keyboard, a phone.
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';

import {close, folder, open, status, until} from './running.mjs';

const state = folder();
let daemon;
let browser;

before(async () => ({daemon, browser} = await open(state, '--q', '16')));
after(() => close(state, daemon, browser));

async function inside(options) {
  const page = await (await browser.newContext(options)).newPage();
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  await page.goto(`http://127.0.0.1:${daemon.web}/`);
  await until(page, (s) => s.firstPictureMs !== null && s.finest, 60, 'a picture');
  return {page, faults};
}

const focused = (page) => page.evaluate(() => document.activeElement.id || document.activeElement.textContent);
const sheet = (page) => page.getByRole('dialog', {name: 'Keys and gestures'});

// Where the view is after a key was held for a while.
async function viewAfter(page, key) {
  await page.keyboard.press(key, {delay: 250});
  await page.waitForTimeout(500);
  return (await status(page)).view;
}

test('a key that is held does not go on behind the sheet, and Home leads back to the start', async () => {
  const {page, faults} = await inside({viewport: {width: 480, height: 270}, reducedMotion: 'reduce'});
  const start = (await status(page)).view;
  await page.locator('#scene').focus();
  await page.keyboard.down('KeyS');
  await page.waitForTimeout(500);
  await page.keyboard.press('?');
  await sheet(page).waitFor();
  await page.waitForTimeout(500);
  const behind = (await status(page)).view;
  assert.notDeepEqual(behind.position, start.position, 'it walked');
  await page.waitForTimeout(1000);
  assert.deepEqual((await status(page)).view, behind, 'and stands behind the sheet');
  await page.keyboard.up('KeyS');
  await page.keyboard.press('Escape');
  await page.keyboard.press('Home');
  await page.waitForTimeout(500);
  assert.deepEqual((await status(page)).view, start);
  assert.deepEqual(faults, []);
  await page.close();
});

test('the help is a button and the key ?, keeps the focus and the keys to itself, and gives both back', async () => {
  const {page, faults} = await inside({viewport: {width: 480, height: 270}, reducedMotion: 'reduce'});
  const help = sheet(page);
  assert.ok(await help.isHidden());
  await page.getByRole('button', {name: 'Help'}).focus();
  await page.keyboard.press('Enter');
  await help.waitFor();
  for (const words of ['look up, down', 'Two, apart or together', 'Left stick', 'Wheel']) {
    assert.ok((await help.innerText()).includes(words), words);
  }
  assert.equal(await focused(page), 'Close');
  for (let i = 0; i < 4; ++i) {
    await page.keyboard.press('Tab');
    assert.ok(!['scene', 'mode', 'share', 'show-panel', 'show-help'].includes(await focused(page)), 'the focus stays in it');
  }
  const before = (await status(page)).view;
  await page.locator('#help h2').click();  // the focus is nowhere then
  for (const key of ['KeyW', 'ArrowLeft', 'KeyO']) assert.deepEqual(await viewAfter(page, key), before, key);
  assert.equal((await status(page)).mode, 'walk');
  const scrolled = () => page.evaluate(() => document.getElementById('help').scrollTop);
  await page.keyboard.press('PageDown');
  await page.waitForFunction(() => document.getElementById('help').scrollTop > 0);
  assert.ok(await scrolled() > 0, 'keys scroll what does not fit');
  await page.keyboard.press('Escape');
  assert.ok(await help.isHidden());
  assert.equal(await focused(page), 'show-help');
  await page.locator('#scene').focus();
  await page.keyboard.press('?');
  await help.waitFor();
  await page.keyboard.press('?');
  assert.ok(await help.isHidden());
  assert.equal(await focused(page), 'scene');
  const moving = await page.evaluate(() => document.getAnimations().length);
  assert.equal(moving, 0, 'nothing on the page moves by itself');
  assert.notDeepEqual(await viewAfter(page, 'KeyW'), before, 'and keys walk again');
  assert.deepEqual(faults, []);
  await page.context().close();
});

test('in the panel the keys that scroll scroll it where it overflows, and do not walk', async () => {
  const {page} = await inside({viewport: {width: 320, height: 180}});
  await page.getByRole('button', {name: 'Numbers'}).click();
  const panel = page.locator('#panel');
  await panel.waitFor();
  await page.waitForFunction(() => document.getElementById('panel').tabIndex === 0);
  await panel.focus();
  const before = (await status(page)).view;
  for (const key of ['PageDown', 'ArrowDown', 'ArrowUp', 'ArrowLeft']) {
    assert.deepEqual(await viewAfter(page, key), before, key);
  }
  await page.keyboard.press('PageDown');
  await page.waitForFunction(() => document.getElementById('panel').scrollTop > 0);
  assert.notDeepEqual(await viewAfter(page, 'KeyW'), before, 'letters walk all the same');
  await page.setViewportSize({width: 900, height: 700});
  await page.locator('#scene').focus();
  await page.waitForFunction(() => document.getElementById('panel').tabIndex === -1, undefined, {timeout: 10_000});
  const there = (await status(page)).view;
  assert.notDeepEqual(await viewAfter(page, 'ArrowLeft'), there);
  await page.context().close();
});

test('on a phone everything is on the screen, large enough for a thumb, and the help can be read', async () => {
  const {page, faults} = await inside({viewport: {width: 360, height: 640}, hasTouch: true, isMobile: true});
  const boxes = async (selector) => page.evaluate((chosen) => [...document.querySelectorAll(chosen)].map((element) => {
    const {left, top, right, bottom} = element.getBoundingClientRect();
    return {id: element.id || element.textContent, left, top, right, bottom};
  }), selector);
  const fits = (box, width = 360, height = 640) => assert.ok(
    box.left >= 0 && box.top >= 0 && box.right <= width && box.bottom <= height, JSON.stringify(box));
  await page.getByRole('button', {name: 'Numbers'}).tap();
  for (const [width, height] of [[180, 320], [640, 360], [360, 640]]) {  // twice as large, turned, as it is
    await page.setViewportSize({width, height});
    const shown = await boxes('#buttons button, #panel');
    shown.forEach((box) => fits(box, width, height));
    for (const [i, a] of shown.entries()) {
      if (a.id !== 'panel') assert.ok(a.right - a.left >= 44 && a.bottom - a.top >= 44, JSON.stringify(a));
      for (const b of shown.slice(i + 1)) {
        const apart = a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
        assert.ok(apart, `${a.id} and ${b.id} lie over each other`);
      }
    }
  }
  await page.getByRole('button', {name: 'Help'}).tap();
  await sheet(page).waitFor();
  (await boxes('#help, #help button')).forEach((box) => fits(box));
  const wide = await page.evaluate(() => document.getElementById('help').scrollWidth > document.getElementById('help').clientWidth);
  assert.ok(!wide, 'it is read from top to bottom alone');
  await page.getByRole('button', {name: 'Close'}).tap();
  assert.ok(await sheet(page).isHidden());
  await page.getByRole('button', {name: 'Help'}).tap();
  await page.touchscreen.tap(180, 4);  // beside it
  assert.ok(await sheet(page).isHidden());
  assert.deepEqual(faults, []);
  await page.context().close();
});

test('what is hidden says how it comes back', async () => {
  const {page} = await inside({viewport: {width: 480, height: 270}});
  await page.keyboard.press('KeyH');
  assert.ok(await page.getByRole('button', {name: 'Link'}).isHidden());
  assert.match(await page.getByRole('status').innerText(), /H brings the buttons back/);
  await page.keyboard.press('KeyH');
  await page.getByRole('button', {name: 'Link'}).waitFor();
  await page.context().close();
});
