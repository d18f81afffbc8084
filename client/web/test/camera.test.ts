import assert from 'node:assert/strict';
import {test} from 'node:test';

import {Vector3} from 'three/src/math/Vector3.js';

import {forward, fromPose, kSteepest, orientation, projectionMatrix, right, tidy, toPose, up, viewAlong,
  viewMatrix} from '../src/page/camera.js';
import type {View} from '../src/page/camera.js';

const view: View = {position: [1, 2, 3], yaw: 0.7, pitch: -0.3, fovy: 1};

function close(a: readonly number[], b: readonly number[], within: number): void {
  a.forEach((value, i) => assert.ok(Math.abs(value - b[i]!) <= within, `${a} is not ${b}`));
}

test('axes are those of the orientation that travels', () => {
  const q = orientation(view);
  close(new Vector3(0, 0, -1).applyQuaternion(q).toArray(), forward(view), 1e-12);
  close(new Vector3(1, 0, 0).applyQuaternion(q).toArray(), right(view), 1e-12);
  close(new Vector3(0, 1, 0).applyQuaternion(q).toArray(), up(view), 1e-12);
});

test('a pose keeps its view there and back', () => {
  const back = fromPose(toPose(view, 100, 50));
  close(back.position, view.position, 0);
  close([back.yaw, back.pitch, back.fovy], [view.yaw, view.pitch, view.fovy], 1e-12);
});

test('a view along a direction looks along it', () => {
  for (const d of [[1, 0, 0], [-1, 2, 0.5], [0, 0, 1], [0.1, -5, 0]] as const) {
    const along = forward(viewAlong([0, 0, 0], [...d], 1));
    const length = Math.hypot(...d);
    close(along, d.map((c) => c / length), 2e-3);  // straight up is held a thousandth of a radian short
  }
});

test('the view matrix puts the eye at the origin and what is ahead on -Z, far from the file origin too', () => {
  const origin = [1e6, -2e6, 3e6] as [number, number, number];
  const far: View = {...view, position: [1e6 + 1, -2e6 + 2, 3e6 + 3]};
  const m = viewMatrix(far, origin);
  close(new Vector3(1, 2, 3).applyMatrix4(m).toArray(), [0, 0, 0], 1e-9);
  const f = forward(far);
  close(new Vector3(1 + 2 * f[0], 2 + 2 * f[1], 3 + 2 * f[2]).applyMatrix4(m).toArray(), [0, 0, -2], 1e-9);
});

test('depth runs from near to far, and from one to zero where it is reversed', () => {
  const depth = (z: number, reversed: boolean): number => {
    const p = new Vector3(0, 0, -z).applyMatrix4(projectionMatrix(1, 1.5, 0.1, 100, reversed));
    return p.z;
  };
  close([depth(0.1, false), depth(100, false), depth(0.1, true)], [-1, 1, 1], 1e-9);
  assert.ok(depth(100, true) < 0.01 && depth(100, true) > 0);
});

test('no input gives a view that cannot be drawn', () => {
  const wild = tidy({position: [NaN, Infinity, 1], yaw: 1e9, pitch: 9, fovy: NaN});
  assert.deepEqual(wild.position, [0, 0, 1]);
  assert.ok(Math.abs(wild.yaw) <= Math.PI && wild.pitch === kSteepest && wild.fovy > 0.5);
});
