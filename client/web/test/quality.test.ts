import assert from 'node:assert/strict';
import {test} from 'node:test';

import {FrameGuard, kLadder} from '../src/page/quality.js';

test('a slow device comes to a picture it can draw within a few frames', () => {
  const guard = new FrameGuard();
  const cost = (level: number): number => 400 / 2.2 ** level;
  let now = 0;
  for (let i = 0; i < 8; ++i) guard.note(guard.moving, cost(guard.level), (now += 100));
  assert.ok(cost(guard.level) <= 33, `level ${guard.level} takes ${cost(guard.level)} ms`);
});

test('one slow frame changes nothing', () => {
  const guard = new FrameGuard();
  for (let i = 0; i < 20; ++i) guard.note(guard.moving, i === 10 ? 300 : 12, i * 16);
  assert.equal(guard.level, 0);
});

test('with time to spare it grows finer again, and does not swing', () => {
  const guard = new FrameGuard();
  for (let i = 0; i < 4; ++i) guard.note(guard.moving, 70, i * 16);
  const coarse = guard.level;
  assert.ok(coarse > 0);
  for (let i = 0; i < 300; ++i) guard.note(guard.moving, 20, i * 16);
  assert.equal(guard.level, coarse, '20 ms fit, but are not to spare');
  for (let i = 0; i < 600; ++i) guard.note(guard.moving, 4, i * 16);
  assert.equal(guard.level, 0);
});

test('it never leaves the ladder', () => {
  const guard = new FrameGuard();
  for (let i = 0; i < 100; ++i) guard.note(guard.moving, 5000, i);
  assert.equal(guard.moving, kLadder.at(-1));
});

test('pictures of a still view leave most of the time to others', () => {
  const guard = new FrameGuard();
  assert.ok(guard.mayRefine(0));
  guard.note(guard.finest, 500, 1000);
  assert.ok(!guard.mayRefine(1500));
  assert.ok(guard.mayRefine(2000));
});
