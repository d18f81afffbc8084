import assert from 'node:assert/strict';
import {test} from 'node:test';

import {forward} from '../src/page/camera.js';
import {Rig, minus, walkSpeed} from '../src/page/rig.js';
import type {Vec3} from '../src/shared/scene.js';

function rigIn(size: number, position: Vec3 = [0, 0, 0]): Rig {
  return new Rig({position, yaw: 0, pitch: 0, fovy: 1}, {low: [-size, -size, -size], high: [size, size, size]}, false);
}

test('speeds suit a scene of 7 mm and one of 3 km', () => {
  const crossing = (diagonal: number): number => diagonal / walkSpeed(diagonal);
  assert.ok(crossing(0.007) > 5 && crossing(0.007) < 20, 'a thing on the table is crossed in seconds');
  assert.ok(Math.abs(walkSpeed(20) - 1.6) < 1e-9, 'a house is walked at a person\'s pace');
  assert.ok(crossing(3000) > 60 && crossing(3000) < 300, 'a valley is crossed in minutes');
  for (let d = 0.001; d < 1e5; d *= 1.5) assert.ok(walkSpeed(d * 1.5) > walkSpeed(d), 'larger is never slower');
});

test('walking ahead is level, whatever is looked at, and hurrying is faster', () => {
  const rig = rigIn(10);
  rig.look(0, -1);
  rig.walk([0, 0, 1], false, 1);
  assert.ok(Math.abs(rig.view.position[1]) < 1e-12);
  const slow = -rig.view.position[2];
  assert.ok(Math.abs(slow - walkSpeed(rig.diagonal)) < 1e-9);
  rig.view = {...rig.view, position: [0, 0, 0]};
  rig.walk([0, 0, 1], true, 1);
  assert.ok(-rig.view.position[2] > 2 * slow);
});

test('two keys at once are not faster than one', () => {
  const rig = rigIn(10);
  rig.walk([1, 0, 1], false, 1);
  assert.ok(Math.abs(Math.hypot(...rig.view.position) - walkSpeed(rig.diagonal)) < 1e-9);
});

test('with easing it comes to rest by itself, without it at once', () => {
  const rig = rigIn(10);
  rig.easing = true;
  rig.walk([0, 0, 1], false, 0.05);
  assert.ok(rig.moving);
  for (let i = 0; i < 200; ++i) rig.walk([0, 0, 0], false, 0.016);
  assert.ok(!rig.moving);
  rig.easing = false;
  rig.walk([0, 0, 1], false, 0.05);
  rig.walk([0, 0, 0], false, 0.016);
  assert.ok(!rig.moving);
});

test('an orbit keeps the pivot at its place on the screen and at its distance', () => {
  const rig = rigIn(10, [30, 5, 0]);
  assert.equal(rig.mode, 'orbit', 'an eye outside looks at an object');
  rig.view = {...rig.view, yaw: Math.PI / 2};
  const seen = (): [number, number] => {
    const arm = minus(rig.pivot, rig.view.position);
    const f = forward(rig.view);
    return [Math.hypot(...arm), arm[0] * f[0] + arm[1] * f[1] + arm[2] * f[2]];
  };
  const before = seen();
  for (let i = 0; i < 50; ++i) rig.orbit(0.1, -0.02);
  seen().forEach((value, i) => assert.ok(Math.abs(value - before[i]!) < 1e-9));
});

test('coming nearer never passes the pivot', () => {
  const rig = rigIn(0.0035, [0.02, 0, 0]);
  for (let i = 0; i < 1000; ++i) rig.dolly(1);
  assert.ok(rig.view.position[0] > 0);
  for (let i = 0; i < 1000; ++i) rig.dolly(-1);
  assert.ok(Number.isFinite(rig.view.position[0]) && rig.view.position[0] < 1);
});

test('an eye inside walks', () => assert.equal(rigIn(10, [3, 1, -2]).mode, 'walk'));
