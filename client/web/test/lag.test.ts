import assert from 'node:assert/strict';
import {test} from 'node:test';

import {create} from '@bufbuild/protobuf';

import {StampsSchema} from '../src/gen/darm_pb.js';
import {answerOf} from '../src/worker/lag.js';

const stamps = {clientSent: 1_000_000n, cameraReceived: 50_000n, viewStarted: 90_000n, viewReady: 100_000n,
  composed: 101_000n, encodeStarted: 103_000n, pictureComposed: 104_000n, encoded: 124_000n, sent: 125_000n};

test('the stages of a lag are all of it', () => {
  const answer = answerOf(create(StampsSchema, stamps), 1_115_000, 1_123_000)!;
  assert.deepEqual(answer.stages, {network: 40, wait: 40, visibility: 10, shading: 3, encode: 21, queue: 1, decode: 8});
  const sum = Object.values(answer.stages).reduce((a, b) => a + b, 0);
  assert.equal(sum, (answer.decodedUs - answer.sentUs) / 1000);
});

test('a step without a stamp took no time, and the sum stays', () => {
  const answer = answerOf(create(StampsSchema, {...stamps, encodeStarted: 0n}), 1_115_000, 1_123_000)!;
  assert.equal(answer.stages.shading, 0);
  assert.equal(answer.stages.encode, 24);
});

test('a frame that answers no camera has no lag', () => {
  assert.equal(answerOf(undefined, 1, 2), null);
  assert.equal(answerOf(create(StampsSchema, {...stamps, clientSent: 0n}), 1, 2), null);
});
