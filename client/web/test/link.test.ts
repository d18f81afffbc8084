import assert from 'node:assert/strict';
import {test} from 'node:test';

import type {View} from '../src/page/camera.js';
import {fromHash, isBroken, toHash} from '../src/page/link.js';

test('a view comes back from its link, in a scene of 7 mm and one of 3 km', () => {
  for (const size of [0.007, 10, 3000]) {
    const view: View = {position: [size / 3, -size / 7, size * 0.9], yaw: 2.5, pitch: -0.41, fovy: 0.9};
    const back = fromHash(toHash(view));
    assert.ok(back);
    back.position.forEach((p, i) => assert.ok(Math.abs(p - view.position[i]!) < size * 1e-8));
    assert.ok(Math.abs(back.yaw - view.yaw) < 1e-6 && Math.abs(back.pitch - view.pitch) < 1e-6);
    assert.ok(Math.abs(back.fovy - view.fovy) < 1e-6);
    assert.equal(toHash(back), toHash(view), 'a link that is passed on stays the same');
  }
});

test('a link that other programs wrote on still leads to its view', () => {
  const plain = fromHash('#view=-3.64,1.75,-0.26,-109,2,58');
  assert.ok(plain !== null);
  assert.deepEqual(fromHash('#view=-3.64%2C1.75%2c-0.26%2C-109%2C2%2C58'), plain);
  assert.deepEqual(fromHash('#view=-3.64,1.75,-0.26,-109,2,58&utm_source=mail'), plain);
});

test('a link that was cut or made up is no view', () => {
  for (const hash of ['', '#', '#view=', '#view=1,2,3', '#view=1,2,3,4,5,60,7', '#view=1,2,NaN,0,0,60',
    '#view=1,2,Infinity,0,0,60', '#view=1e99,0,0,0,0,60', '#view=1,2,3,0,91,60', '#view=1,2,3,0,0,0',
    '#view=1,2,3,0,0,170', '#view=1,2,3,0,0,<b>', '#other=1,2,3,4,5,60', '#view=0x10,2,3,0,0,60']) {
    assert.equal(fromHash(hash), null, hash);
  }
});

test('a link that names a view which cannot be drawn is told from one that names none', () => {
  assert.ok(isBroken('#view=1,2,3'));
  assert.ok(isBroken('#view=-3.8,1.5,0.44,-50,10,58.'), 'with the full stop of a sentence');
  for (const hash of ['', '#', '#other=1', '#view=-3.64,1.75,-0.26,-109,2,58']) assert.ok(!isBroken(hash), hash);
});
