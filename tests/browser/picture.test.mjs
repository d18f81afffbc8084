// The picture in the browser against the reference and against the native client's.
import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';

import {browse, folder, linkOf, picture, probe, psnr, render, serve, until} from './running.mjs';

const kSize = {width: 320, height: 180};
const kSpp = 32;
const kSeconds = 20;

const state = folder();
let daemon;
let browser;
let reference;

before(async () => {
  reference = render(state.path, 'hall', `${kSize.width}x${kSize.height}`, kSpp);
  daemon = await serve(state.path);
  browser = await browse();
});
after(async () => {
  await browser?.close();
  await daemon?.stop();
  state.remove();
});

// A page at the hall's camera with nothing but the scene on it.
async function look() {
  const context = await browser.newContext({viewport: kSize});
  const page = await context.newPage();
  await page.goto(`http://127.0.0.1:${daemon.web}/${linkOf('hall')}`);
  const first = await until(page, (s) => s.firstPictureMs !== null, 60, 'a picture');
  await page.keyboard.press('KeyH');
  return {page, first};
}

async function score(page) {
  await page.waitForFunction(() => document.getElementById('notice').hidden);
  await until(page, (s) => s.finest, 10, 'a picture at its finest');
  return psnr(await picture(page), reference);
}

test('after 20 s from an empty store it is at 30 dB at least', async (t) => {
  const opened = Date.now();
  const {page, first} = await look();
  t.diagnostic(`first complete picture after ${first.firstPictureMs.toFixed(0)} ms, ${first.bytesToFirstPicture} bytes`);
  await page.waitForTimeout(Math.max(0, kSeconds * 1000 - (Date.now() - opened)));
  const dB = await score(page);
  t.diagnostic(`after ${kSeconds} s: ${dB.toFixed(2)} dB`);
  await page.context().close();
  assert.ok(dB >= 30, `${dB} dB`);
});

// Both at once, so that they have the same shared light and light of their own of the same age.
test('it is within 1 dB of the native client', async (t) => {
  const {page} = await look();
  const native = await probe(daemon.tcp, 'hall', `${kSize.width}x${kSize.height}`, kSeconds, reference, state.path);
  const dB = await score(page);
  t.diagnostic(`browser ${dB.toFixed(2)} dB, native ${native.psnr.toFixed(2)} dB`);
  await page.context().close();
  assert.ok(Math.abs(dB - native.psnr) <= 1, `browser ${dB} dB, native ${native.psnr} dB`);
});
