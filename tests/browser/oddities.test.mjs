// What nobody does on purpose: windows of one pixel, links that are none, going back and forward from view to view.
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';

import {close, folder, open, status, until} from './running.mjs';

const state = folder();
let daemon;
let browser;

before(async () => ({daemon, browser} = await open(state, '--q', '16')));
after(() => close(state, daemon, browser));

const small = {viewport: {width: 320, height: 180}};

async function inside(hash = '') {
  const page = await (await browser.newContext(small)).newPage();
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  await page.goto(`http://127.0.0.1:${daemon.web}/${hash}`);
  await until(page, (s) => s.firstPictureMs !== null, 60, 'a picture');
  return {page, faults};
}

test('any size of window is drawn, down to one pixel, and as finely as the screen is', async () => {
  const {page, faults} = await inside();
  for (const [width, height] of [[1, 1], [900, 1], [1, 500], [320, 180]]) {
    await page.setViewportSize({width, height});
    await page.mouse.move(0, 0);
    await page.mouse.down();
    await page.mouse.move(3, 2);
    await page.mouse.up();
    const drawn = (await status(page)).framesDrawn;
    await until(page, (s) => s.framesDrawn > drawn || s.finest, 60, `a picture of ${width}x${height}`);
  }
  const s = await status(page);
  assert.ok(s.joined && s.joins === 1, 'the server minds no size');
  assert.ok([...s.view.position, s.view.yaw, s.view.pitch].every(Number.isFinite));
  await page.context().close();
  const fine = await (await browser.newContext({...small, deviceScaleFactor: 3})).newPage();
  await fine.goto(`http://127.0.0.1:${daemon.web}/`);
  await until(fine, (now) => now.firstPictureMs !== null, 60, 'a picture');
  const pixels = await fine.evaluate(() => [document.getElementById('scene').width, document.getElementById('scene').height]);
  assert.deepEqual(pixels, [960, 540]);
  await fine.context().close();
  assert.deepEqual(faults, []);
});

test('a link that is no view begins at the start; back and forward go from view to view', async () => {
  const plain = await inside();
  const start = (await status(plain.page)).view;
  await plain.page.context().close();
  for (const hash of ['#view=NaN,1,2,0,0,60', `#view=${'9'.repeat(100_000)}`, '#view=1,2,3,0,0,60#<b>', '#%00%ff']) {
    const {page, faults} = await inside(hash);
    assert.deepEqual((await status(page)).view, start, hash.slice(0, 40));
    assert.deepEqual(faults, []);
    await page.context().close();
  }
  const {page, faults} = await inside('#view=9e8,0,0,0,90,1');
  assert.ok((await status(page)).joined, 'one that leads far away is a view');
  const at = async (x) => until(page, (s) => s.view.position[0] === x, 20, `the view at ${x}`);
  for (const x of [1, 2]) {
    await page.evaluate((to) => (location.hash = `#view=${to},2,0,10,0,60`), x);
    await at(x);
    await page.waitForTimeout(700);  // it writes its link meanwhile
  }
  await page.evaluate(() => history.back());
  await at(1);
  await page.waitForTimeout(700);
  await page.evaluate(() => history.forward());
  await at(2);
  await page.evaluate(() => (location.hash = '#view=none'));
  await page.waitForTimeout(300);
  await at(2);
  assert.equal((await status(page)).joins, 1);
  assert.deepEqual(faults, []);
  await page.context().close();
});
