import assert from 'node:assert/strict';
import {test} from 'node:test';

import {kLeaveAfterMs, kSceneComesMs, Presence} from '../src/page/presence.js';
import {ScriptedBrowser} from './scripted_browser.js';

const browser = new ScriptedBrowser();

class Visitor {
  readonly did: string[] = [];
  scene = true;
  readonly presence = new Presence({sceneIsHere: () => this.scene, leave: () => this.did.push('leave'),
    comeBack: () => this.did.push('come back')});
}

test('a page that is hidden lets its session go after a while, and has one again when it is seen', async () => {
  const {presence, did} = new Visitor();
  presence.seen(false);
  await browser.pass(kLeaveAfterMs - 1);
  assert.deepEqual(did, []);
  await browser.pass(2);
  assert.deepEqual(did, ['leave']);
  await browser.pass(60 * kLeaveAfterMs);
  presence.seen(false);
  await browser.pass(2 * kLeaveAfterMs);
  assert.deepEqual(did, ['leave'], 'once is enough');
  presence.seen(true);
  presence.seen(true);
  assert.deepEqual(did, ['leave', 'come back']);
});

test('a look at another page costs nobody a session', async () => {
  const {presence, did} = new Visitor();
  for (let i = 0; i < 5; ++i) {
    presence.seen(false);
    await browser.pass(kLeaveAfterMs - 10);
    presence.seen(true);
    await browser.pass(kLeaveAfterMs);
  }
  assert.deepEqual(did, []);
});

test('a scene that is still coming is waited for, but not for ever', async () => {
  const slow = new Visitor();
  slow.scene = false;
  slow.presence.seen(false);
  await browser.pass(3 * kLeaveAfterMs + 1);
  assert.deepEqual(slow.did, []);
  slow.scene = true;
  await browser.pass(kLeaveAfterMs);
  assert.deepEqual(slow.did, ['leave']);
  const stuck = new Visitor();
  stuck.scene = false;
  stuck.presence.seen(false);
  await browser.pass(kSceneComesMs + kLeaveAfterMs);
  assert.deepEqual(stuck.did, ['leave']);
});

test('a page that is put away leaves at once, hidden before or not, and comes back once', async () => {
  const {presence, did} = new Visitor();
  presence.seen(false);
  presence.putAway();
  presence.putAway();
  await browser.pass(2 * kLeaveAfterMs);
  assert.deepEqual(did, ['leave']);
  presence.seen(true);
  assert.deepEqual(did, ['leave', 'come back']);
});
